/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Paths through dispersive glass: bidirectional against plain path tracing, for smooth and rough glass; and glass
 * whose index hardly varies, where paths carry one wavelength, against plain glass, where they carry four. Level and
 * power: tests/support/agreement.h.
 */
#include "tests/support/agreement.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/render.h"
#include "worker/render/path/connect.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* A ball on a floor under a sky: almost all of the noise comes from drawing one wavelength. */
static struct world *sky_over_ball_world(const char *bsdf)
{
	/* clang-format off */
	return world_from_text(32, 32,
		"<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
		SENSOR("0,1,5", "0,-0.2,0")
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='3'/>"
				"<rotate x='1' angle='-90'/>"
				"<translate y='-1'/>"
			"</transform>"
			"<bsdf type='diffuse'><rgb name='reflectance' value='0.4,0.6,0.7'/></bsdf>"
		"</shape>"
		"<emitter type='constant'><rgb name='radiance' value='1,0.9,0.8'/></emitter>"
		"<shape type='sphere'>"
			"<point name='center' value='0,-0.2,0'/>"
			"<float name='radius' value='0.8'/>"
			"%s"
		"</shape>",
		bsdf);
	/* clang-format on */
}

#define SMOOTH(inner) "<bsdf type='dielectric'>" inner "</bsdf>"
#define ROUGH(inner) "<bsdf type='roughdielectric'><float name='alpha' value='0.3'/>" inner "</bsdf>"
#define STRONG_DISPERSION "<float name='int_ior' value='1.6'/><float name='int_cauchy_b' value='0.06'/>"
#define PLAIN_INDEX "<float name='int_ior' value='1.5'/>"
#define TINY_DISPERSION PLAIN_INDEX "<float name='int_cauchy_b' value='1e-9'/>"
#define ZERO_DISPERSION PLAIN_INDEX "<float name='int_cauchy_b' value='0'/>"

static void render(struct world *w, const char *test, const char *side, const char *integrator, uint64_t spp,
		   struct agreement_image *out)
{
	struct agreement_options options = {integrator, spp, 32, 0, 0};
	agreement_render(w, test, side, &options, out);
}

static const struct effect_line *find_effect_line(const struct world *w, const char *name)
{
	for (size_t i = 0; i < w->effects.effect_line_count; i++)
		if (strcmp(w->effects.effect_lines[i].name, name) == 0)
			return &w->effects.effect_lines[i];
	fail_msg("no line %s", name);
	return NULL;
}

static void check_bdpt_against_path(const char *name, const char *bsdf, uint64_t spp)
{
	static struct agreement_image path, bdpt;
	struct world *w = sky_over_ball_world(bsdf);
	assert_true(w->effects.dispersion && w->effects.colour && find_effect_line(w, "dispersion")->is_on);
	assert_non_null(strstr(find_effect_line(w, "dispersion")->reason, "varies with wavelength"));
	render(w, name, "path", "path", spp, &path);
	render(w, name, "bdpt", "bdpt", spp, &bdpt);
	agreement_check(name, &bdpt, &path);
	world_free(w);
}

static void bdpt_agrees_with_path_for_smooth_dispersive_glass(void **state)
{
	(void)state;
	check_bdpt_against_path("smooth glass that disperses", SMOOTH(STRONG_DISPERSION), 768);
}

static void bdpt_agrees_with_path_for_rough_dispersive_glass(void **state)
{
	(void)state;
	check_bdpt_against_path("rough glass that disperses", ROUGH(STRONG_DISPERSION), 768);
}

static void check_hero_wavelength_against_four(const char *name, const char *hardly, const char *plain, uint64_t spp)
{
	static struct agreement_image one, four;
	struct world *w = sky_over_ball_world(hardly);
	assert_true(w->effects.dispersion);
	render(w, name, "one", "path", spp, &one);
	world_free(w);
	w = sky_over_ball_world(plain);
	assert_true(!w->effects.dispersion && !find_effect_line(w, "dispersion")->is_on);
	render(w, name, "four", "path", spp, &four);
	world_free(w);
	agreement_check(name, &one, &four);
}

static void test_one_wavelength_stands_for_four(void **state)
{
	(void)state;
	check_hero_wavelength_against_four("one wavelength, smooth", SMOOTH(TINY_DISPERSION), SMOOTH(PLAIN_INDEX), 768);
	check_hero_wavelength_against_four("one wavelength, rough", ROUGH(TINY_DISPERSION), ROUGH(PLAIN_INDEX), 768);
}

static void zero_dispersion_is_the_plain_scene(void **state)
{
	(void)state;
	static struct agreement_image zero, plain;
	struct world *w = sky_over_ball_world(ROUGH(ZERO_DISPERSION));
	render(w, "nothing", "path", "path", 32, &zero);
	world_free(w);
	w = sky_over_ball_world(ROUGH(PLAIN_INDEX));
	render(w, "nothing", "path", "path", 32, &plain);
	world_free(w);
	assert_memory_equal(zero.mean, plain.mean, sizeof plain.mean);
}

/* Returns whether the path joined by path_connect() scatters at a dispersive surface. */
static bool path_meets_dispersive_surface(const struct path_context *c, unsigned s, unsigned t)
{
	for (unsigned i = 1; i < s; i++)
		if (c->light[i].bsdf->is_dispersive)
			return true;
	for (unsigned i = 1; i < t; i++)
		if (c->camera[i].bsdf && c->camera[i].bsdf->is_dispersive && !(s == 0 && i + 1 == t))
			return true;
	return false;
}

/* Every technique leaves a path that meets dispersive glass one wavelength, and all other paths four. */
static void every_technique_leaves_dispersed_paths_one_wavelength(void **state)
{
	(void)state;
	enum { DEPTH = 6 };
	static struct path_context c;
	uint64_t counters[BATCH_COUNTERS] = {0};
	size_t one[DEPTH + 1] = {0}, four[DEPTH + 1] = {0};
	struct world *w = sky_over_ball_world(ROUGH(STRONG_DISPERSION));
	c = (struct path_context){
		.w = w, .window = {0, 0, 32, 32}, .min_depth = 1, .max_depth = DEPTH, .counters = counters};
	for (uint64_t i = 0; i < 20000; i++) {
		struct sampler_random random;
		double film[2];
		sampler_random_init(&random, stats_seed(__func__), RNG_TEST, i, 0);
		unsigned camera = path_walk_camera(&c, &random.base, DEPTH + 1, film);
		unsigned light = path_walk_light(&c, &random.base, DEPTH);
		for (unsigned t = 1; t <= camera; t++)
			for (unsigned s = t == 1 ? 2 : 0; s <= light && s + t - 1 <= DEPTH; s++) {
				spectrum l =
					s + t < 2 ? spectrum_constant(0) : path_connect(&c, s, t, PATH_EDGES_MAX, film);
				if (!(l.v[0] > 0))
					continue;
				bool alone = l.v[1] == 0 && l.v[2] == 0 && l.v[3] == 0;
				if (alone != path_meets_dispersive_surface(&c, s, t))
					fail_msg("s = %u, t = %u: %g %g %g %g", s, t, l.v[0], l.v[1], l.v[2], l.v[3]);
				(alone ? one : four)[s]++;
			}
	}
	for (unsigned s = 0; s <= 3; s++) {
		print_message("s = %u: %zu paths with one wavelength, %zu with four\n", s, one[s], four[s]);
		/* the vertex after the first one of a light sub-path can only lie on the ball */
		assert_true(one[s] > 50 && (s == 3) == (four[s] == 0));
	}
	world_free(w);
}

static void test_collapse(void **state)
{
	(void)state;
	const spectrum l = {{1, 2, 3, 4}};
	spectrum one = path_collapse_to_hero(l, true), four = path_collapse_to_hero(l, false);
	assert_true(one.v[0] == 4 && one.v[1] == 0 && one.v[2] == 0 && one.v[3] == 0);
	assert_memory_equal(&four, &l, sizeof l);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bdpt_agrees_with_path_for_smooth_dispersive_glass),
		cmocka_unit_test(bdpt_agrees_with_path_for_rough_dispersive_glass),
		cmocka_unit_test(test_one_wavelength_stands_for_four),
		cmocka_unit_test(zero_dispersion_is_the_plain_scene),
		cmocka_unit_test(every_technique_leaves_dispersed_paths_one_wavelength),
		cmocka_unit_test(test_collapse),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
