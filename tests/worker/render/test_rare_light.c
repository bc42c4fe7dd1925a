/* SPDX-License-Identifier: Apache-2.0 */
/* Light that is rare for bdpt, and light that only seems to be: the sun on the floor of a pool; a caustic that is
 * bright on few pixels, which light sub-paths find; a room where only path finds next to no light behind a mirror.
 * The measured shares must lie within bounds known for these scenes. */
#include "tests/support/worlds.h"
#include "worker/render/path/integrate_path.h"
#include "worker/render/rare_light.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

enum { SAMPLES = 1 << 14, MERGED = 1 << 12, WIDTH = 160, HEIGHT = 90 };

static double rare_light_share(struct world *w, uint64_t seed)
{
	static struct path_context c;
	static struct path_sample sample;
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct brightness map;
	struct error e;
	struct rare_light found;
	c = (struct path_context){.w = w,
				  .window = {0, 0, WIDTH, HEIGHT},
				  .min_depth = 1,
				  .max_depth = 8,
				  .max_survival = PATH_SURVIVAL_MAX,
				  .skips_classes = true,
				  .counters = counters};
	assert_int_equal(brightness_init(&map, &c.window, SAMPLES, BRIGHTNESS_SAMPLES_PER_CELL, &e), 0);
	for (uint64_t i = 0; i < SAMPLES; i++) {
		struct sampler_random s;
		sampler_random_init(&s, seed, RNG_TEST, i, 0);
		path_trace(&c, &s.base, &sample);
		brightness_add_sample(&map, &sample);
	}
	brightness_compute_scales(&map, SAMPLES);
	assert_int_equal(rare_light_estimate(&c, &map, seed, 0, MERGED, &found), 0);
	brightness_fini(&map);
	return found.rare_share;
}

/* The share must lie within these bounds for each seed; the shares in the scene's own table (README of tests/bench)
 * keep a distance from them of half as much again or more. */
static void expect_share(const char *folder, const char *file, double min_share, double max_share)
{
	struct world *w = world_from_own_scene(folder, file, WIDTH, HEIGHT);
	for (uint64_t seed = 0; seed < 3; seed++) {
		double share = rare_light_share(w, seed);
		printf("%s: %.4f\n", file, share);
		if (!(share >= min_share && share <= max_share))
			fail_msg("%s: %g, not within %g and %g", file, share, min_share, max_share);
	}
	world_free(w);
}

static void rare_light_has_a_large_share(void **state)
{
	(void)state;
	expect_share("../bench/scenes", "pool.xml", 0.03, 0.2);
	expect_share("../bench/scenes", "torus.xml", 0.03, 0.2);
	expect_share("displaced", "water.xml", 0.15, 0.6);
}

static void common_light_has_a_small_share(void **state)
{
	(void)state;
	expect_share("../bench/scenes", "ring.xml", 0, 0.02);
	expect_share("../bench/scenes", "rough-caustic.xml", 0, 0.01);
	expect_share("demo", "scene.xml", 0, 0.02);
	expect_share("box", "box.xml", 0, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(rare_light_has_a_large_share),
					   cmocka_unit_test(common_light_has_a_small_share)};
	return cmocka_run_group_tests_name("worker/render/rare_light", tests, NULL, NULL);
}
