/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The texture `volume`: compared at points of the scene with the function from which its grid was made, on spheres,
 * meshes, instances and lights, with one channel and with three; a roughness on a grid, whose smallest value is found;
 * a volume without a grid; errors.
 */
#include "worker/render/volume/volume.h"
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const struct wavelengths colour = {.nm = {450, 550, 600, 700}};
static struct vol grid;

/* A linear function of position, which the grid represents exactly between the centres of its outermost cells. */
static double linear_field(double x, double y, double z, uint32_t channel)
{
	return 0.2 + 0.3 * x + (channel == 1 ? 0 : 0.2 * y) + (channel == 2 ? -0.15 : 0.1) * z;
}

/* clang-format off */
#define VOLUME(property) \
	"<texture type='volume' name='" property "'><volume type='gridvolume' name='volume'>" \
	"<string name='filename' value='g.vol'/>" \
	"<transform name='to_world'><scale value='4'/><translate x='-2' y='-2' z='-2'/></transform></volume></texture>"
/* clang-format on */
#define DIFFUSE "<bsdf type='diffuse' id='m'>" VOLUME("reflectance") "</bsdf>"
#define SKY "<emitter type='constant'/>"

static struct world *world_with(uint32_t channels, const char *inner)
{
	static char xml[4096];
	vol_make(&grid, (const uint32_t[3]){8, 8, 8}, channels, linear_field);
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>" SENSOR("0,0,9", "0,0,0") "%s</scene>", inner);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"g.vol", grid.bytes, grid.size}, {0}};
	return world_from_files(8, 8, files);
}

/* Returns the value at a point of the world: the box of the grid runs from -2 to 2, and its first and last points are
 * half a cell inside. */
static double expected_value(const struct world *w, vec3 p, uint32_t channel)
{
	vec3 q = vec3_madd(w->center, 1 / w->scale, p);
	return linear_field((q.x + 1.75) / 3.5, (q.y + 1.75) / 3.5, (q.z + 1.75) / 3.5, channel);
}

static void assert_reflectance(const struct world *w, const struct surface_point *x, uint32_t channels)
{
	const struct bsdf *b = &w->bsdfs[w->shape_bindings[x->prim.shape].bsdf];
	const struct bsdf_point p = world_bsdf_point(x, &colour, TRANSPORT_RADIANCE);
	spectrum found = spectrum_scale(M_PI, b->ops->eval(b, &p, (vec3){0, 0, 1}, (vec3){0, 0, 1}));
	double rgb[3];
	for (uint32_t k = 0; k < 3; k++)
		rgb[k] = expected_value(w, x->p, channels > 1 ? k : 0);
	spectrum wanted = channels > 1 ? color_eval_rgb_reflectance(rgb, &colour) : spectrum_constant(rgb[0]);
	for (int l = 0; l < SPECTRUM_LANES; l++)
		if (fabs(found.v[l] - wanted.v[l]) > 1e-5)
			fail_msg("shape %u, lane %d: %g, not %g", x->prim.shape, l, found.v[l], wanted.v[l]);
}

/* Triangles; and two instances of one mesh with one material. */
static void test_reflectances_follow_the_grid(void **state)
{
	(void)state;
	for (uint32_t channels = 1; channels <= 3; channels += 2) {
		struct world *w = world_with(
			channels, SKY
			"<shape type='cube'>" DIFFUSE "</shape>"
			"<shape type='shapegroup' id='g'><shape type='disk'><ref id='m'/></shape></shape>"
			"<shape type='instance'><ref id='g'/><transform name='to_world'><translate x='0.5' z='1.5'/>"
			"</transform></shape><shape type='instance'><ref id='g'/><transform name='to_world'>"
			"<rotate x='1' angle='70'/><translate y='-0.5'/></transform></shape>");
		assert_int_equal(w->shape_count, 3);
		assert_true(w->bsdfs[w->shape_bindings[0].bsdf].is_textured &&
			    w->shape_bindings[1].bsdf == w->shape_bindings[2].bsdf);
		assert_true((w->bsdfs[w->shape_bindings[0].bsdf].color_kind == COLOR_KIND_OTHER) == (channels > 1));
		for (uint32_t i = 0; i < 3; i++)
			for (uint32_t t = 0; t < w->shapes[i].triangle_count; t += 3) {
				struct surface_point x;
				surface_on_triangle(&w->shapes[i], (struct prim_ref){i, t, 0}, 0.2,
						    0.1 + (t % 7) / 10.0, &x);
				assert_reflectance(w, &x, channels);
			}
		world_free(w);
	}
}

/* Checks an area light with a volume at sampled points, and at points that paths hit. */
static void check_lamp(const char *shape, uint32_t channels)
{
	char inner[1024];
	snprintf(inner, sizeof inner, "<shape type='%s'><emitter type='area'>" VOLUME("radiance") "</emitter></shape>",
		 shape);
	struct world *w = world_with(channels, inner);
	const struct emitter *em = &w->emitters[0];
	struct dice d = dice_for_test("a lamp with a volume");
	assert_true(em->is_textured && em->power > 0);
	for (int i = 0; i < 100; i++) {
		const double u[2] = {dice_between(&d, 0, 1), dice_between(&d, 0, 1)};
		struct emitter_point drawn;
		struct surface_point met;
		double pdf, rgb[3];
		assert_true(em->ops->sample_point(em, u, &drawn, &pdf));
		for (uint32_t k = 0; k < 3; k++)
			rgb[k] = expected_value(w, drawn.p, channels > 1 ? k : 0);
		assert_true(surface_nearest(&w->shapes[0], (struct prim_ref){0, drawn.texture_point.prim, 0}, drawn.p,
					    &met));
		struct emitter_point as_met = world_emitter_point(&met);
		spectrum wanted = color_eval_rgb_illuminant(rgb, &colour),
			 found[2] = {em->ops->radiance(em, &drawn, drawn.n, &colour),
				     em->ops->radiance(em, &as_met, drawn.n, &colour)};
		for (int l = 0; l < SPECTRUM_LANES; l++)
			for (int k = 0; k < 2; k++)
				if (fabs(found[k].v[l] - wanted.v[l]) > 1e-4 * wanted.v[l] ||
				    wanted.v[l] > em->brightness_bound * (1 + 1e-9))
					fail_msg("%s: %g, not %g", shape, found[k].v[l], wanted.v[l]);
	}
	world_free(w);
}

static void test_lamps_follow_the_grid(void **state)
{
	(void)state;
	check_lamp("sphere", 1);
	check_lamp("sphere", 3);
	check_lamp("rectangle", 3);
}

/* The smallest roughness is found by probing points all over the grid. */
static void test_smallest_roughness_is_found(void **state)
{
	(void)state;
	struct world *w = world_with(
		1, SKY "<shape type='sphere'><bsdf type='roughconductor'>" VOLUME("alpha") "</bsdf></shape>");
	const struct bsdf *b = &w->bsdfs[0];
	if (!(b->min_alpha >= 0.2 && b->min_alpha < 0.22))
		fail_msg("alpha %g", b->min_alpha);
	world_free(w);
}

static void test_constant_volumes_equal_constants(void **state)
{
	(void)state;
#define EVEN(inner)                                                                                                   \
	SKY "<shape type='sphere'><bsdf type='diffuse'><texture type='volume' name='reflectance'>" inner "</texture>" \
	    "</bsdf></shape>"
	static const struct {
		const char *inner;
		double expected;
	} cases[] = {
		{EVEN(""), 0.75},
		{EVEN("<float name='volume' value='0.25'/>"), 0.25},
		{EVEN("<volume type='constvolume' name='volume'><float name='value' value='0.5'/></volume>"), 0.5},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct world *w = world_with(1, cases[i].inner);
		const struct bsdf *b = &w->bsdfs[0];
		const struct bsdf_point p = {.wavelengths = &colour};
		double found = M_PI * b->ops->eval(b, &p, (vec3){0, 0, 1}, (vec3){0, 0, 1}).v[0];
		assert_true(fabs(found - cases[i].expected) < 1e-12);
		world_free(w);
	}
}

static void test_invalid_volume_textures_are_refused(void **state)
{
	(void)state;
#define TEXTURE(property) "<texture type='volume' name='" property "'/>"
	world_check_refused(
		SKY "<shape type='sphere'><bsdf type='bumpmap'>" TEXTURE("a") "<bsdf type='diffuse'/></bsdf></shape>",
		"a volume cannot displace a surface or bend its normals");
	world_check_refused("<emitter type='projector'>" TEXTURE("irradiance") "</emitter>",
			    "a volume is a texture for surfaces only");
	world_check_refused(SKY "<shape type='sphere'><bsdf type='diffuse'><texture type='volume' name='reflectance'>"
				"<float name='volume' value='1.5'/></texture></bsdf></shape>",
			    "1.5");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_reflectances_follow_the_grid),
		cmocka_unit_test(test_lamps_follow_the_grid),
		cmocka_unit_test(test_smallest_roughness_is_found),
		cmocka_unit_test(test_constant_volumes_equal_constants),
		cmocka_unit_test(test_invalid_volume_textures_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
