/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `collimated`, a beam without width, in images known in closed form: all of its light reaches the one pixel that
 * sees the lit point, directly or by way of a mirror; a plate lit from that point; and a line of light in a medium.
 * The integrators with light sub-paths must agree with the closed forms; `path`, which has none, must refuse the
 * scene.
 *
 * Level: five standard errors of 32 groups (t), which is 2e-5 for each of 19 comparisons. Power: standard errors are
 * below 0.5 %.
 */
#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/cli/base/options.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 16, GROUPS = 32 };

#define DEPTH(k) "<integrator type='volpath'><integer name='max_depth' value='" k "'/></integrator>"
#define BEAM(from, to)                                                                                               \
	"<emitter type='collimated'><float name='power' value='3'/><transform name='to_world'><lookat origin='" from \
	"' target='" to "' up='0.1,0.2,0.97'/></transform></emitter>"
#define GREY(share) "<bsdf type='diffuse'><float name='reflectance' value='" share "'/></bsdf>"
#define PLATE(transform, inner) \
	"<shape type='rectangle'><transform name='to_world'>" transform "</transform>" inner "</shape>"

/* Fails unless the mean of X + Y + Z over all pixels is that of an image in which every pixel has the radiance
 * `expected`. */
static void check_mean_radiance(const char *name, const struct world *w, double expected,
				const char *const *integrators, uint64_t spp)
{
	static struct agreement_image image;
	double expected_sum = expected * (w->grey_xyz[0] + w->grey_xyz[1] + w->grey_xyz[2]), mean[GROUPS];
	assert_false(w->effects.colour);
	for (size_t i = 0; integrators[i]; i++) {
		char test[64];
		snprintf(test, sizeof test, "%s, %s", name, integrators[i]);
		struct agreement_options side = {integrators[i], spp, GROUPS, 0, 0};
		agreement_render(w, test, integrators[i], &side, &image);
		for (int g = 0; g < GROUPS; g++)
			mean[g] = image.mean[g][AGREEMENT_CELLS] / expected_sum;
		struct stats_mean m = stats_mean_test(mean, GROUPS, 1);
		print_message("%s: %.6f +- %.6f\n", test, m.mean, m.error);
		if (!(fabs(m.mean - 1) < 5 * m.error + 1e-5) || (!test_is_scaled() && !(m.error < 0.005)))
			fail_msg("%s: %g +- %g of what is known", test, m.mean, m.error);
	}
}

static const char *const all_integrators[] = {"bdpt", "bdpt8", "erpt", "erpt4", "pssmlt", "hslt", NULL};
static const char *const integrators_without_bdpt8[] = {"bdpt", "erpt4", "pssmlt", "hslt", NULL};

static double mean_pixel_intensity(const struct world *w, double intensity, vec3 place)
{
	vec3 in_world = vec3_scale(w->scale, vec3_sub(place, w->center)), d = vec3_sub(in_world, w->camera.position);
	double distance = vec3_length(d) / w->scale;
	return intensity * camera_jac_film_from_solid(&w->camera, vec3_normalize(d)) / (distance * distance) /
	       (SIDE * SIDE);
}

/* A beam of power 3 makes a spot of intensity 3 rho / pi times a cosine on the plate. The one pixel that sees the
 * spot gets this intensity over the squared distance and over the pixel's solid angle. */
static void beam_lights_the_one_pixel_that_sees_its_spot(void **state)
{
	(void)state;
	struct world *w = world_from_text(SIDE, SIDE,
					  DEPTH("2") SENSOR("0.5,0.3,3", "0,0,0") BEAM("-1,2,4", "0.2,0.1,0")
						  PLATE("<scale value='2'/>", GREY("0.6")));
	vec3 to = vec3_normalize((vec3){0.5 - 0.2, 0.3 - 0.1, 3});
	double expected = mean_pixel_intensity(w, 3 * 0.6 / M_PI * to.z, (vec3){0.2, 0.1, 0});
	assert_true(w->emitters[0].is_delta && w->emitters[0].is_beam && expected > 0);
	check_mean_radiance("spot", w, expected, all_integrators, 1536);
	world_free(w);
}

/* A perfect mirror at x = 1 sends the beam on. */
static void mirror_sends_the_beam_on(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		SIDE, SIDE,
		DEPTH("3") SENSOR("0.5,0.3,3", "0,0,0") BEAM("0,0,1.6", "1,0.05,0.8")
			PLATE("<scale value='2'/>", GREY("0.6"))
				PLATE("<scale value='0.5'/><rotate y='1' angle='-90'/><translate x='1' z='0.8'/>",
				      "<bsdf type='conductor'><string name='material' value='none'/></bsdf>"));
	vec3 place = {0, 0.1, 0}, to = vec3_normalize((vec3){0.5, 0.3 - 0.1, 3});
	check_mean_radiance("mirror", w, mean_pixel_intensity(w, 3 * 0.6 / M_PI * to.z, place),
			    integrators_without_bdpt8, 1024);
	world_free(w);
}

/* The beam hits a wall behind the camera at (0, 0, 2), and this spot lights the plate at z = 0. */
static void spot_behind_the_camera_lights_the_plate(void **state)
{
	(void)state;
	struct world *w = world_from_text(SIDE, SIDE,
					  DEPTH("3") SENSOR("0.8,0,1.5", "0.2,0,0") BEAM("-1.5,0.5,1", "0,0,2")
						  PLATE("<scale value='4'/>", GREY("0.7"))
							  PLATE("<scale value='3'/><rotate x='1' angle='180'/>"
								"<translate z='2'/>",
								GREY("0.5")));
	enum { FINE = 200 };
	double sum = 0;
	for (int i = 0; i < FINE * FINE; i++) {
		vec3 d = camera_direction(&w->camera, w->camera.position, SIDE * (i % FINE + 0.5) / FINE,
					  SIDE * (i / FINE + 0.5) / FINE);
		vec3 at = vec3_madd((vec3){0.8, 0, 1.5}, -1.5 / d.z, d), from = vec3_sub((vec3){0, 0, 2}, at);
		double r2 = vec3_dot(from, from), cosine = from.z / sqrt(r2);
		assert_true(d.z < 0);
		sum += 3 * 0.5 / M_PI * cosine * cosine / r2 * 0.7 / M_PI;
	}
	check_mean_radiance("lit from there", w, sum / (FINE * FINE),
			    (const char *const[]){"bdpt", "bdpt8", "erpt", "pssmlt", "hslt", NULL}, 1024);
	world_free(w);
}

/* The beam scatters in a cube of fog with sigma_t = 0.4 and sigma_s = 0.3. From each piece dt of the beam the film
 * gets 3 sigma_s / (4 pi) exp(-sigma_t (t + d)) / d^2 dt, where d is the distance from the near plane, at which the
 * camera lies here. The camera does not see the end of the beam. */
static void fog_scatters_the_beam_once(void **state)
{
	(void)state;
	/* clang-format off */
	struct world *w = world_from_text(SIDE, SIDE,
		"<medium type='homogeneous' id='fog'>"
			"<float name='sigma_t' value='0.4'/>"
			"<float name='albedo' value='0.75'/>"
		"</medium>"
		DEPTH("2")
		"<sensor type='perspective'>"
			"<float name='fov' value='40'/>"
			"<float name='near_clip' value='1e-5'/>"
			"<transform name='to_world'><lookat origin='0,0,3' target='0,0,0' up='0,1,0'/></transform>"
			"<ref id='fog'/>"
			"<film type='hdrfilm'><rfilter type='box'/></film>"
		"</sensor>"
		BEAM("-3,-0.4,0.2", "3,0.5,-0.2")
		"<shape type='cube'>"
			"<transform name='to_world'><scale value='5'/></transform>"
			"<bsdf type='null'/>"
			"<ref name='interior' id='fog'/>"
		"</shape>");
	/* clang-format on */
	enum { PIECES = 100000 };
	const double length = 9, sigma = 0.4;
	vec3 o = {-3, -0.4, 0.2}, d = vec3_normalize((vec3){6, 0.9, -0.4}), eye = {0, 0, 3};
	double sum = 0, x, y;
	for (int i = 0; i < PIECES; i++) {
		double t = (i + 0.5) * length / PIECES;
		vec3 p = vec3_madd(o, t, d), away = vec3_sub(p, eye);
		double far = vec3_length(away);
		if (!camera_project(&w->camera, w->camera.position, vec3_normalize(away), far * w->scale, &x, &y) ||
		    x < 0 || x >= SIDE || y < 0 || y >= SIDE)
			continue;
		sum += mean_pixel_intensity(
			w, 3 * 0.75 * sigma / (4 * M_PI) * exp(-sigma * (t + far)) * length / PIECES, p);
	}
	check_mean_radiance("fog", w, sum, integrators_without_bdpt8, 2048);
	world_free(w);
}

static void invalid_beams_are_refused(void **state)
{
	(void)state;
	world_check_refused("<emitter type='collimated'><float name='power' value='-1'/></emitter>", "power");
	world_check_refused(
		"<emitter type='collimated'><transform name='to_world'><scale z='0'/></transform></emitter>",
		"to_world gives the beam no direction");
	/* `path` would leave the light of the beam out. */
	struct world *w = world_from_text(
		SIDE, SIDE, SENSOR("0,0,3", "0,0,0") BEAM("-1,2,4", "0,0,0") PLATE("<scale value='2'/>", ""));
	struct render_summary summary;
	world_summary(w, &summary);
	assert_true(summary.has_beam);
	struct render_arguments a = {.plan = {.spp = 4, .integrator = "path"}};
	struct error e = {""};
	assert_int_equal(render_plan_from_scene(&a, &summary, &e), -EINVAL);
	assert_non_null(strstr(e.text, "the integrator path cannot find the light of `collimated`"));
	strcpy(a.plan.integrator, "bdpt");
	assert_int_equal(render_plan_from_scene(&a, &summary, &e), 0);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(beam_lights_the_one_pixel_that_sees_its_spot),
		cmocka_unit_test(mirror_sends_the_beam_on),
		cmocka_unit_test(spot_behind_the_camera_lights_the_plate),
		cmocka_unit_test(fog_scatters_the_beam_once),
		cmocka_unit_test(invalid_beams_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
