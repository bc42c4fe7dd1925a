/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Delta emitters: their positions, their intensity by direction, and the densities of sampled directions. Chi-square
 * tests at level 1e-6; a density wrong by 3 % in half of the cells is found with certainty. Everything else is exact
 * but for rounding.
 */
#include "worker/render/render.h"
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define LEVEL 1e-6

static const struct wavelengths grey = {.is_grey = true};
/* The spectrum of intensity 1. */
static const struct color unit_intensity = {.kind = COLOR_KIND_D65, .scale = 1, .is_times_d65 = true};

/* A sphere at (10, 0, 0) of radius 4, so that the world is translated and scaled by a power of two. */
static struct world *make_world(const char *version, const char *emitters)
{
	static char text[4096];
	snprintf(text, sizeof text,
		 "<scene version='%s'>" SENSOR(
			 "0,0,9", "0,0,0") "%s<shape type='sphere'><point name='center' x='10' y='0' z='0'/>"
					   "<float name='radius' value='4'/></shape></scene>",
		 version, emitters);
	const struct memory_file files[] = {{"s.xml", text, strlen(text)}, {NULL, NULL, 0}};
	return world_from_files(8, 8, files);
}

static struct emitter_point only_point(const struct emitter *em)
{
	struct emitter_point x, y;
	double pdf, toward;
	assert_true(em->is_delta && !em->ops->point_inverse);
	assert_true(em->ops->sample_point(em, (double[]){0.3, 0.9}, &x, &pdf));
	assert_true(emitter_sample_toward(em, (vec3){1, 2, 3}, (double[]){0.8, 0.1}, &y, &toward));
	assert_true(pdf == 1 && toward == 1 && em->ops->pdf_point(em, &x) == 1 &&
		    emitter_pdf_toward(em, (vec3){1, 2, 3}, &x) == 1);
	assert_true(x.p.x == y.p.x && x.p.y == y.p.y && x.p.z == y.p.z && x.is_infinite == y.is_infinite);
	assert_true(x.is_infinite == em->is_infinite);
	return x;
}

static bool is_near(vec3 a, vec3 b)
{
	return vec3_length(vec3_sub(a, b)) < 1e-12 * (1 + vec3_length(b));
}

/* Both dialects, and both ways of giving the position. Light falls off with the square of the distance in scene
 * units. */
static void test_positions_of_both_dialects_agree(void **state)
{
	(void)state;
#define AT(name) "<transform name='" name "'><scale value='2'/><translate x='3' y='4' z='-5'/></transform>"
#define LOOK(name) "<transform name='" name "'><lookat origin='3,4,-5' target='10,0,0' up='0,0,1'/></transform>"
#define ALONG(name) "<transform name='" name "'><lookat origin='1,1,1' target='1,-5,9' up='1,0,0'/></transform>"
#define EMITTER(type, place, name) "<emitter type='" type "'>" place "<float name='" name "' value='6'/></emitter>"
	static const struct {
		const char *version, *emitter;
	} points[] =
		{
			{"3.0.0", EMITTER("point", "<point name='position' x='3' y='4' z='-5'/>", "intensity")},
			{"0.5.0", EMITTER("point", "<point name='position' x='3' y='4' z='-5'/>", "intensity")},
			{"3.0.0", EMITTER("point", AT("to_world"), "intensity")},
			{"0.5.0", EMITTER("point", AT("toWorld"), "intensity")},
			{"3.0.0", EMITTER("spot", LOOK("to_world"), "intensity")},
			{"0.5.0", EMITTER("spot", LOOK("toWorld"), "intensity")},
		},
	  parallel[] = {
		  {"3.0.0", EMITTER("directional", "<vector name='direction' x='0' y='-6' z='8'/>", "irradiance")},
		  {"0.5.0", EMITTER("directional", "<vector name='direction' x='0' y='-6' z='8'/>", "irradiance")},
		  {"3.0.0", EMITTER("directional", ALONG("to_world"), "irradiance")},
		  {"0.5.0", EMITTER("directional", ALONG("toWorld"), "irradiance")},
	  };
	for (size_t i = 0; i < sizeof points / sizeof *points; i++) {
		struct world *w = make_world(points[i].version, points[i].emitter);
		const struct emitter *em = &w->emitters[0];
		struct emitter_point x = only_point(em);
		assert_true(is_near(x.p, vec3_scale(w->scale, vec3_sub((vec3){3, 4, -5}, w->center))));
		assert_true(vec3_length(x.n) == 0 && !x.is_infinite && w->environment == -1);
		vec3 axis = vec3_normalize((vec3){7, -4, 5});
		assert_true(fabs(em->ops->radiance(em, &x, axis, &grey).v[0] / (w->scale * w->scale) - 6) < 1e-12);
		assert_true(em->power > 0 && em->brightness_bound > 6 * w->scale * w->scale &&
			    isfinite(em->brightness_bound));
		world_free(w);
	}
	for (size_t i = 0; i < sizeof parallel / sizeof *parallel; i++) {
		struct world *w = make_world(parallel[i].version, parallel[i].emitter);
		const struct emitter *em = &w->emitters[0];
		struct emitter_point x = only_point(em);
		/* Towards the light. */
		assert_true(x.is_infinite && is_near(x.p, (vec3){0, 0.6, -0.8}) && w->environment == -1);
		assert_true(em->ops->radiance(em, &x, vec3_neg(x.p), &grey).v[0] == 6);
		assert_true(fabs(em->power / (M_PI * w->radius * w->radius) - 6 * color_mean(&unit_intensity)) < 1e-9);
		world_free(w);
	}
}

/* Directions for intervals of u[0] fall into equal parts of the cap; their density; and the power by quadrature. */
static void check_directions(const char *name, const struct emitter *em, vec3 axis, double cap, double power)
{
	enum { CELLS = 12 };
	uint64_t counts[CELLS * CELLS] = {0};
	double expected[CELLS * CELLS], sum = 0, total = 0;
	struct emitter_point x = only_point(em);
	struct frame f = frame_around(axis);
	struct dice d = dice_for_test(name);
	size_t n = dice_scaled_count(100000);
	for (size_t i = 0; i < n; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, pdf;
		vec3 w;
		assert_true(em->ops->sample_direction(em, &x, u, &w, &pdf));
		assert_true(fabs(vec3_length(w) - 1) < 1e-14);
		vec3 l = frame_to_local(&f, w);
		double down = (1 - l.z) / cap, turn = atan2(l.y, l.x) / (2 * M_PI);
		assert_true(down < 1 + 1e-12);
		/* On the edge of the cone, the intensity may round to 0. */
		assert_true(em->ops->pdf_direction(em, &x, w) == pdf || down > 1 - 1e-12);
		size_t row = (size_t)fmin(down * CELLS, CELLS - 1),
		       column = (size_t)fmin((turn < 0 ? turn + 1 : turn) * CELLS, CELLS - 1);
		counts[row * CELLS + column]++;
	}
	for (int i = 0; i < CELLS * CELLS; i++) {
		enum { SUB = 12 };
		expected[i] = 0;
		for (int k = 0; k < SUB * SUB; k++) {
			double z = 1 - cap * (i / CELLS + (k / SUB + 0.5) / SUB) / CELLS,
			       phi = 2 * M_PI * (i % CELLS + (k % SUB + 0.5) / SUB) / CELLS;
			double r = sqrt(1 - z * z), area = 2 * M_PI * cap / (CELLS * CELLS * SUB * SUB);
			vec3 w = frame_to_world(&f, (vec3){r * cos(phi), r * sin(phi), z});
			expected[i] += em->ops->pdf_direction(em, &x, w) * area * (double)n;
			total += em->ops->radiance(em, &x, w, &grey).v[0] * area;
		}
		sum += expected[i] / (double)n;
	}
	double p = stats_counts_p(counts, expected, CELLS * CELLS);
	print_message("%s: p = %.2g, power %.5g\n", name, p, total);
	assert_true(fabs(sum - 1) < 1e-9 && p > LEVEL);
	/* The fall-off begins like a square root of the height. */
	assert_true(fabs(total / power - 1) < 1e-3);
}

static void test_directions_follow_their_density(void **state)
{
	(void)state;
	struct world *w = make_world("3.0.0", "<emitter type='point'/>");
	double unit = w->scale * w->scale, mean = color_mean(&unit_intensity);
	check_directions("point", &w->emitters[0], (vec3){0, 0, 1}, 2, w->emitters[0].power / mean);
	assert_true(fabs(w->emitters[0].power / (4 * M_PI * unit * mean) - 1) < 1e-12);
	world_free(w);
	const double cutoffs[] = {0.5, 20, 60, 120, 180}, beams[] = {0, 0.75, 1};
	for (int i = 0; i < 15; i++) {
		char text[256], name[64];
		double cutoff = cutoffs[i / 3], beam = beams[i % 3] * cutoff;
		snprintf(
			text, sizeof text,
			"<emitter type='spot'><float name='cutoffAngle' value='%g'/><float name='beamWidth' value='%g'/></emitter>",
			cutoff, beam);
		snprintf(name, sizeof name, "spot of %g degrees, %g of them full", cutoff, beam);
		w = make_world("0.6.0", text);
		const struct emitter *em = &w->emitters[0];
		check_directions(name, em, (vec3){0, 0, 1}, 1 - cos(cutoff * M_PI / 180), em->power / mean);
		/* Linear in the angle between beam and cut-off. */
		struct emitter_point x = only_point(em);
		for (double t = 0.001; t < 180; t += 0.37) {
			double expected = t <= beam	? 1
					  : t >= cutoff ? 0
							: (cutoff - t) / (cutoff - beam),
			       a = t * M_PI / 180;
			double got = em->ops->radiance(em, &x, (vec3){sin(a), 0, cos(a)}, &grey).v[0] / unit;
			assert_true(fabs(got - expected) < 1e-9 || fabs(t - cutoff) < 1e-9);
		}
		world_free(w);
	}
	w = make_world("3.0.0", "<emitter type='spot'/>");
	struct emitter_point x = only_point(&w->emitters[0]);
	double a = 17.5 * M_PI / 180;
	assert_true(
		fabs(w->emitters[0].ops->radiance(&w->emitters[0], &x, (vec3){sin(a), 0, cos(a)}, &grey).v[0] / unit -
		     0.5) < 1e-9);
	world_free(w);
}

/* A constant instead of an image, which Mitsuba 0.6 ignores. */
static void test_constant_texture_scales_the_spot_in_3_x_only(void **state)
{
	(void)state;
	for (int old = 0; old <= 1; old++) {
		struct world *w = make_world(old ? "0.6.0" : "3.0.0",
					     "<emitter type='spot'><spectrum name='texture' value='0.25'/></emitter>");
		const struct emitter *em = &w->emitters[0];
		struct emitter_point x = only_point(em);
		double unit = w->scale * w->scale, got = em->ops->radiance(em, &x, (vec3){0, 0, 1}, &grey).v[0] / unit;
		assert_true(fabs(got - (old ? 1 : 0.25)) < 1e-9);
		world_free(w);
	}
}

static bool has_effect(const struct world *w, const char *effect)
{
	struct render_summary s;
	world_summary(w, &s);
	return render_effect_is_on(&s, effect);
}

static void test_world_has_the_effects_of_its_lights(void **state)
{
	(void)state;
	struct world *w = make_world(
		"3.0.0",
		"<emitter type='directional'/><emitter type='constant'/><emitter type='point'/><emitter type='directional'/>");
	assert_int_equal(w->emitter_count, 4);
	assert_int_equal(w->environment, 1);
	assert_true(has_effect(w, "delta-light") && has_effect(w, "environment") && !has_effect(w, "area-light") &&
		    !w->effects.colour);
	world_free(w);
	w = make_world("3.0.0", "<emitter type='constant'/>");
	assert_false(has_effect(w, "delta-light"));
	world_free(w);
}

static void test_invalid_delta_lights_are_refused(void **state)
{
	(void)state;
	/* clang-format off */
	world_check_refused(
		"<emitter type='point'>"
			"<point name='position' x='1' y='0' z='0'/>"
			"<transform name='to_world'><translate x='1'/></transform>"
		"</emitter>",
		"position and to_world are both given");
	/* clang-format on */
	world_check_refused(
		"<emitter type='directional'><vector name='direction' x='1' y='0' z='0'/><transform name='to_world'/></emitter>",
		"direction and to_world are both given");
	world_check_refused("<emitter type='directional'><vector name='direction' x='0' y='0' z='0'/></emitter>",
			    "a direction of length 0");
	world_check_refused("<emitter type='spot'><float name='beam_width' value='30'/></emitter>",
			    "exceeds cutoff_angle=20");
	world_check_refused("<emitter type='constant'/><emitter type='directional'/><emitter type='constant'/>",
			    "may have one environment only");
	world_check_refused("<shape type='sphere'><emitter type='point'/></shape>", "cannot be inside a shape");
	world_check_refused("<emitter type='point'><float name='intensity' value='-1'/></emitter>", "intensity");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_positions_of_both_dialects_agree),
		cmocka_unit_test(test_directions_follow_their_density),
		cmocka_unit_test(test_constant_texture_scales_the_spot_in_3_x_only),
		cmocka_unit_test(test_world_has_the_effects_of_its_lights),
		cmocka_unit_test(test_invalid_delta_lights_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
