/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The ends of paths: a camera with an aperture, and emitters that cannot be hit. Integrators are compared with each
 * other and with closed forms. Statistics as in tests/support/agreement.h: level 1e-4 over the suite; biases of 2 % of
 * a quarter of the image and 0.5 % of its mean are found with 95 % probability, and the exact power is printed.
 */
#include "worker/render/render.h"
#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/dice.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/path/path.h"
#include "worker/render/path/sampler.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Samples per pixel that the power requires; 0: the integrator is not run. */
struct effort {
	uint64_t path, bdpt, pssmlt; /* pssmlt takes minutes and runs with FULL=1 only */
};

/* The first integrator that runs is the reference for the others. Takes ownership of the world. */
static void check_convergence(const char *name, struct world *w, struct effort e)
{
	static struct agreement_image image[2];
	const struct agreement_options sides[] = {{"path", e.path, 32, 0, 0},
						  {"bdpt", e.bdpt, 32, 0, 0},
						  {"pssmlt", test_is_full() ? e.pssmlt : 0, 32, 0, 0}};
	const struct agreement_image *reference = NULL;
	for (size_t i = 0; i < 3; i++) {
		char test[64];
		if (!sides[i].spp)
			continue;
		snprintf(test, sizeof test, "%s, %s", name, sides[i].integrator);
		agreement_render(w, test, sides[i].integrator, &sides[i], &image[reference != NULL]);
		if (reference)
			agreement_check(test, &image[1], reference);
		reference = &image[0];
	}
	world_free(w);
}

#define DIFFUSE(x) "<bsdf type='diffuse'><float name='reflectance' value='" x "'/></bsdf>"
#define AT(inner) "<transform name='to_world'>" inner "</transform>"

/* Everything is out of focus by up to a third of the image's width; the filter reaches two pixels beyond the border. */
static void integrators_agree_out_of_focus(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("ends", "defocus.xml", 16, 16);
	check_convergence("defocus", w, (struct effort){3072, 2048, 65536});
}

struct film_interval {
	double low, high;
};

static double interval_overlap(struct film_interval a, struct film_interval b)
{
	return fmax(fmin(a.high, b.high) - fmax(a.low, b.low), 0);
}

/* An emitting rectangle across the axis at depth z, seen through a lens. For each point a of the aperture, the image
 * is that of a pinhole, moved by a (1/z - 1/focus) in slope; the mean over the aperture is found by quadrature. */
static void defocused_rectangle_has_its_closed_form(void **state)
{
	(void)state;
	enum { RADII = 64, TURNS = 64 };
	const double focus = 2, z = 5, radius = 0.5, half = tan(20 * M_PI / 180);
	const struct film_interval x = {-0.3 / z, 3 / z}, y = {-1.5 / z, 1 / z};
	static struct agreement_image image;
	struct world *w = world_from_own_scene("ends", "blurred-rectangle.xml", 16, 16);
	const struct agreement_options side = {"path", 12288, 32, 0, 0};
	agreement_render(w, __func__, "path", &side, &image);
	double expected[AGREEMENT_CELLS + 1] = {0};
	for (int c = 0; c < AGREEMENT_CELLS; c++) {
		/* Film y runs downwards. */
		struct film_interval bx = {half * (c % 2 - 1), half * (c % 2)},
				     by = {half * (0 - c / 2), half * (1 - c / 2)};
		for (int i = 0; i < RADII * TURNS; i++) {
			double r = radius * sqrt((i / TURNS + 0.5) / RADII), phi = 2 * M_PI * (i % TURNS + 0.5) / TURNS;
			double move = 1 / focus - 1 / z, mx = r * cos(phi) * move, my = r * sin(phi) * move;
			expected[c] += interval_overlap((struct film_interval){x.low + mx, x.high + mx}, bx) *
				       interval_overlap((struct film_interval){y.low + my, y.high + my}, by) /
				       (half * half * RADII * TURNS);
		}
		expected[AGREEMENT_CELLS] += expected[c] / AGREEMENT_CELLS;
	}
	double sum = w->grey_xyz[0] + w->grey_xyz[1] + w->grey_xyz[2];
	for (uint32_t g = 0; g < image.groups; g++)
		for (int c = 0; c <= AGREEMENT_CELLS; c++)
			image.mean[g][c] /= expected[c] * sum;
	agreement_check_constant("blurred rectangle", &image, 1);
	/* A pinhole gives a very different image, so the comparison can tell the two cameras apart. */
	double sharp = interval_overlap(x, (struct film_interval){-half, 0}) *
		       interval_overlap(y, (struct film_interval){0, half}) / (half * half);
	assert_true(fabs(expected[0] / sharp - 1) > 0.1);
	world_free(w);
}

/* A floor at y = 0, seen straight from above, and its lights. has_mirror: a mirror stands on the floor at x = -1.5. */
struct lamps {
	vec3 point_position, spot_position, spot_target,
		direction; /* direction: of the parallel light; the spot ends at 40 degrees */
	double intensity, spot_intensity, irradiance, sky;
	bool has_mirror;
};

static double irradiance_from_point_light(vec3 lamp, double intensity, vec3 at)
{
	vec3 d = vec3_sub(lamp, at);
	return intensity * d.y / pow(vec3_dot(d, d), 1.5);
}

/* Returns the irradiance at (x, z). Divided by pi, it is the radiance of a white floor. */
static double irradiance(const struct lamps *l, double x, double z)
{
	vec3 at = {x, 0, z}, image = {-3 - l->point_position.x, l->point_position.y, l->point_position.z};
	double sum = irradiance_from_point_light(l->point_position, l->intensity, at) +
		     l->irradiance * -vec3_normalize(l->direction).y;
	if (l->has_mirror)
		sum = 2 * sum - irradiance_from_point_light(l->point_position, l->intensity, at) +
		      irradiance_from_point_light(image, l->intensity, at);
	if (l->spot_intensity > 0) {
		vec3 axis = vec3_normalize(vec3_sub(l->spot_target, l->spot_position));
		double degrees = acos(vec3_dot(axis, vec3_normalize(vec3_sub(at, l->spot_position)))) * 180 / M_PI;
		sum += irradiance_from_point_light(l->spot_position, l->spot_intensity, at) *
		       fmin(fmax((40 - degrees) / 15, 0), 1);
	}
	return sum / M_PI + l->sky;
}

static void check_floor(const char *name, const struct lamps *l, struct effort e)
{
	enum { N = 480 }; /* the midpoint rule errs by 1e-6; with 48 by 7e-5, which the samples would reveal */
	static struct agreement_image image;
	const struct agreement_options sides[] = {{"path", e.path, 32, 0, 0},
						  {"bdpt", e.bdpt, 32, 0, 0},
						  {"pssmlt", test_is_full() ? e.pssmlt : 0, 32, 0, 0}};
	/* clang-format off */
	static const char mirror[] =
		"<shape type='rectangle'>"
			AT("<scale value='1.6'/><rotate y='1' angle='90'/><translate x='-1.5'/>")
			"<bsdf type='conductor'><string name='material' value='none'/></bsdf>"
		"</shape>";
	struct world *w = world_from_text(16, 16,
		"<integrator type='path'><integer name='max_depth' value='%d'/></integrator>"
		"<sensor type='perspective'>"
			"<float name='fov' value='40'/>"
			AT("<lookat origin='0,4,0' target='0,0,0' up='0,0,-1'/>")
			"<film type='hdrfilm'><rfilter type='box'/></film>"
		"</sensor>"
		"%s"
		"<shape type='rectangle'>"
			AT("<scale value='1.5'/><rotate x='1' angle='-90'/>")
			DIFFUSE("0.5")
		"</shape>"
		"<emitter type='point'>"
			"<point name='position' x='%g' y='%g' z='%g'/>"
			"<float name='intensity' value='%g'/>"
		"</emitter>"
		"<emitter type='directional'>"
			"<vector name='direction' x='%g' y='%g' z='%g'/>"
			"<float name='irradiance' value='%g'/>"
		"</emitter>"
		"<emitter type='spot'>"
			"<float name='cutoff_angle' value='40'/>"
			"<float name='beam_width' value='25'/>"
			"<float name='intensity' value='%g'/>"
			AT("<lookat origin='%g,%g,%g' target='%g,%g,%g' up='0,0,1'/>")
		"</emitter>"
		"<emitter type='constant'><float name='radiance' value='%g'/></emitter>",
		l->has_mirror ? 3 : 2, l->has_mirror ? mirror : "", l->point_position.x, l->point_position.y,
		l->point_position.z, l->intensity, l->direction.x, l->direction.y, l->direction.z, l->irradiance,
		l->spot_intensity, l->spot_position.x, l->spot_position.y, l->spot_position.z,
		l->spot_target.x, l->spot_target.y, l->spot_target.z, l->sky);
	/* clang-format on */
	assert_true(!w->effects.colour && (w->environment >= 0) == (l->sky > 0));
	double half = 4 * tan(20 * M_PI / 180), sum = w->grey_xyz[0] + w->grey_xyz[1] + w->grey_xyz[2],
	       expected[AGREEMENT_CELLS + 1] = {0};
	for (int c = 0; c < AGREEMENT_CELLS; c++) {
		for (int i = 0; i < N * N; i++) {
			double x = half * (c % 2 - 1 + (i % N + 0.5) / N), z = half * (c / 2 - 1 + (i / N + 0.5) / N);
			expected[c] += 0.5 * sum * irradiance(l, x, z) / (N * N);
		}
		expected[AGREEMENT_CELLS] += expected[c] / AGREEMENT_CELLS;
	}
	for (size_t i = 0; i < 3; i++) {
		char test[64];
		if (!sides[i].spp)
			continue;
		snprintf(test, sizeof test, "%s, %s", name, sides[i].integrator);
		agreement_render(w, test, sides[i].integrator, &sides[i], &image);
		for (uint32_t g = 0; g < image.groups; g++)
			for (int c = 0; c <= AGREEMENT_CELLS; c++)
				image.mean[g][c] /= expected[c];
		agreement_check_constant(test, &image, 1);
	}
	world_free(w);
}

static void floor_has_the_irradiance_of_delta_lights(void **state)
{
	(void)state;
	struct lamps l = {
		.point_position = {0.6, 1.2, -0.4}, .intensity = 2, .direction = {0, -1, 0}, .spot_target = {0, -1, 0}};
	check_floor("point", &l, (struct effort){1024, 1024, 0});
	l = (struct lamps){.spot_position = {-0.5, 2, 0},
			   .spot_target = {0.2, 0, 0.3},
			   .direction = {0, -1, 0},
			   .spot_intensity = 3};
	check_floor("spot", &l, (struct effort){1024, 2048, 0});
	/* Two lights, and the sky, which escaping rays meet. */
	l = (struct lamps){.point_position = {0.6, 2, -0.4},
			   .intensity = 1,
			   .direction = {0.5, -1, 0.2},
			   .irradiance = 0.2,
			   .spot_target = {0, -1, 0},
			   .sky = 0.02};
	check_floor("point, parallel light and sky", &l, (struct effort){5120, 4096, 0});
}

/* Light by way of a mirror is a caustic, which only paths from the light find. */
static void bdpt_finds_caustics_of_a_mirror(void **state)
{
	(void)state;
	struct lamps l = {.point_position = {-0.2, 2, -0.2},
			  .intensity = 2,
			  .direction = {-1, -0.5, 0.03},
			  .spot_target = {0, -1, 0},
			  .has_mirror = true};
	check_floor("mirrored point", &l, (struct effort){0, 6144, 77824});
	l.intensity = 0;
	l.irradiance = 1;
	check_floor("mirrored parallel light", &l, (struct effort){0, 5120, 0});
}

/* Rough glass and metal in light that no path hits: these caustics are found by the path tracer as well. */
static void integrators_agree_on_rough_caustics_of_delta_lights(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("ends", "rough-bodies.xml", 16, 16);
	check_convergence("rough bodies in delta light", w, (struct effort){8192, 8192, 0});
}

/* In a room of perfect mirrors only Russian roulette ends a path. No path may end before the number of scattering
 * events that the scene sets for it; at this event one path in twenty ends: 200 of 4,000 with standard deviation
 * 13.8. The accepted range of 130 to 270 rejects a correct program once in two million; a rate of one in 30 or one in
 * 14 is found with 95 % probability. */
static void roulette_ends_no_path_before_its_depth(void **state)
{
	(void)state;
	enum { EDGES = 64, PATHS = 4000 };
	static struct path_context c;
	static const struct {
		const char *asks;
		unsigned first;
	} rows[] = {{"", 5},
		    {"<integer name='rr_depth' value='1'/>", 1},
		    {"<integer name='rr_depth' value='40'/>", 40},
		    {"<integer name='rr_depth' value='64'/>", EDGES}};
	for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
		/* clang-format off */
		struct world *w = world_from_text(8, 8, "<integrator type='path'>%s</integrator>%s",
			rows[k].asks,
			SENSOR("0,0.2,0.9", "0.1,-0.1,-1")
			"<shape type='cube'>"
				"<bsdf type='conductor'><string name='material' value='none'/></bsdf>"
			"</shape>"
			"<shape type='sphere'><point name='center' x='0' y='0' z='5'/><emitter type='area'/></shape>");
		/* clang-format on */
		uint64_t counters[BATCH_COUNTERS] = {0};
		unsigned there = 0;
		c = (struct path_context){.w = w,
					  .window = {0, 0, 8, 8},
					  .min_depth = 1,
					  .max_depth = EDGES,
					  .max_survival = PATH_SURVIVAL_MAX,
					  .counters = counters};
		for (uint64_t i = 0; i < PATHS; i++) {
			struct sampler_random random;
			double film[2];
			sampler_random_init(&random, stats_seed(__func__), RNG_TEST, i, 0);
			unsigned edges = path_walk_camera(&c, &random.base, EDGES + 1, film) - 1;
			assert_in_range(edges, rows[k].first, EDGES);
			there += edges == rows[k].first;
		}
		if (rows[k].first < EDGES)
			assert_in_range(there, 130, 270);
		world_free(w);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(roulette_ends_no_path_before_its_depth),
		cmocka_unit_test(integrators_agree_out_of_focus),
		cmocka_unit_test(defocused_rectangle_has_its_closed_form),
		cmocka_unit_test(floor_has_the_irradiance_of_delta_lights),
		cmocka_unit_test(bdpt_finds_caustics_of_a_mirror),
		cmocka_unit_test(integrators_agree_on_rough_caustics_of_delta_lights),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
