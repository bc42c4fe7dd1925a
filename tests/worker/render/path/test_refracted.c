/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Refracted connections change the noise of an image but not its mean, even where several refracted paths join two
 * points and where the walk fails to find one: the caustic of a ball. Statistics as in tests/support/agreement.h, but
 * only a bias of 3 % of the mean is found; if all paths were weighted like those that the walk finds, nearly half of
 * the light would be lost. The lamp's image in a floor that is partly a mirror would lose half if paths that are
 * specular at the floor were weighted as if a connection could make them. Where straight lines are blocked and light
 * refracted at a plane passes, the radiance must be that given by Fresnel's formulas.
 */
#include "tests/support/agreement.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static struct world *caustic_world(const char *effects)
{
	worlds_effects = effects;
	/* clang-format off */
	struct world *w = world_from_text(16, 16, "%s",
		"<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
		"<sensor type='perspective'><float name='fov' value='4'/><transform name='to_world'>"
			"<lookat origin='2,-.7,0' target='-.08,-1,0' up='0,1,0'/></transform></sensor>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/>"
			"<translate y='-1'/></transform><bsdf type='diffuse'/></shape>"
		"<shape type='sphere'><point name='center' x='0' y='-.2' z='0'/><float name='radius' value='.5'/>"
			"<bsdf type='dielectric'/></shape>"
		"<shape type='sphere'><point name='center' x='.1' y='1.4' z='0'/><float name='radius' value='.4'/>"
			"<emitter type='area'><float name='radiance' value='3'/></emitter></shape>");
	/* clang-format on */
	worlds_effects = NULL;
	return w;
}

/* A lamp above a pane, and its image in a floor that reflects one half of the light as a mirror and scatters the
 * other half. */
static struct world *image_of_lamp(const char *effects)
{
	worlds_effects = effects;
	/* clang-format off */
	struct world *w = world_from_text(16, 16, "%s",
		"<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
		"<sensor type='perspective'><float name='fov' value='4'/><transform name='to_world'>"
			"<lookat origin='2,0,0' target='1,-1,0' up='0,1,0'/></transform></sensor>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/>"
			"<translate y='-1'/></transform><bsdf type='blendbsdf'><float name='weight' value='.5'/>"
			"<bsdf type='conductor'><string name='material' value='none'/></bsdf><bsdf type='diffuse'/></bsdf></shape>"
		"<shape type='cube'><transform name='to_world'><scale x='3' y='.1' z='3'/><translate y='.5'/></transform>"
			"<bsdf type='dielectric'/></shape>"
		"<shape type='sphere'><point name='center' x='-1.6' y='1.6' z='0'/><float name='radius' value='.4'/>"
			"<emitter type='area'><float name='radiance' value='3'/></emitter></shape>");
	/* clang-format on */
	worlds_effects = NULL;
	return w;
}

/* Compares images with refracted connections, of spp samples per pixel (bdpt: a quarter), with a reference without
 * them of twice as many. */
static void check_with_and_without_refraction(const char *name, struct world *(*build)(const char *effects),
					      uint64_t spp)
{
	static struct agreement_image without, with;
	const struct agreement_options sides[] = {{"path", spp, 32, 0, 0}, {"bdpt", spp / 4, 32, 0, 0}};
	struct world *w = build("-refracted-shadows");
	agreement_render(w, name, "without", &(struct agreement_options){"path", 2 * spp, 32, 0, 0}, &without);
	world_free(w);
	w = build(NULL);
	assert_true(w->effects.refracted_shadows);
	for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
		char test[64];
		snprintf(test, sizeof test, "%s, %s", name, sides[i].integrator);
		agreement_render(w, test, "with", &sides[i], &with);
		agreement_check_any_power(test, &with, &without);
	}
	world_free(w);
}

static void refracted_connections_keep_the_mean_of_a_caustic(void **state)
{
	(void)state;
	check_with_and_without_refraction("caustic", caustic_world, 2048);
}

static void refracted_connections_keep_the_mean_of_a_mirrored_lamp(void **state)
{
	(void)state;
	check_with_and_without_refraction("image of a lamp", image_of_lamp, 512);
}

/* The floor of a pool under a low sun, behind a wall that blocks straight lines to the sun. Refracted light passes
 * above the wall: the irradiance E cos a T(a) arrives, where a is the angle of incidence and T Fresnel's
 * transmittance. */
static void refracted_sun_lights_the_pool_behind_a_wall(void **state)
{
	(void)state;
	static struct agreement_image seen;
	static const char *const integrators[] = {"path", "bdpt"};
	const double index = 1.33, cosine = 0.342 / hypot(0.94, 0.342),
		     inside = sqrt(1 - (1 - cosine * cosine) / (index * index));
	const double s = (cosine - index * inside) / (cosine + index * inside),
		     p = (inside - index * cosine) / (inside + index * cosine);
	const double through = 1 - (s * s + p * p) / 2, expected = 0.5 / M_PI * 3 * cosine * through;
	/* clang-format off */
	struct world *w = world_from_text(16, 16, "%s",
		"<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
		"<sensor type='orthographic'><transform name='to_world'><scale value='.3'/>"
			"<lookat origin='-1,-.2,0' target='-1,-1,0' up='0,0,1'/></transform></sensor>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/>"
			"<translate y='-1'/></transform><bsdf type='diffuse'/></shape>"
		"<shape type='rectangle'><transform name='to_world'><scale x='4' y='.45'/><rotate y='1' angle='-90'/>"
			"<translate x='.5' y='-.55'/></transform><bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/></transform>"
			"<bsdf type='dielectric'><float name='int_ior' value='1.33'/><float name='ext_ior' value='1'/></bsdf></shape>"
		"<emitter type='directional'><vector name='direction' x='-.94' y='-.342' z='0'/>"
			"<float name='irradiance' value='3'/></emitter>");
	/* clang-format on */
	const double white = w->grey_xyz[0] + w->grey_xyz[1] + w->grey_xyz[2];
	for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
		agreement_render(w, "pool", integrators[i], &(struct agreement_options){integrators[i], 64, 32, 0, 0},
				 &seen);
		agreement_check_constant(integrators[i], &seen, expected * white);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(refracted_connections_keep_the_mean_of_a_caustic),
					   cmocka_unit_test(refracted_connections_keep_the_mean_of_a_mirrored_lamp),
					   cmocka_unit_test(refracted_sun_lights_the_pool_behind_a_wall)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
