/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The same scene in other units and at other places, by hslt: the image stays the same. Scaling by powers of two and
 * exact translations give the same bits. Other changes round the coordinates, and a chain that once decides differently
 * goes its own way until the next accepted independent proposal: that changes less than 1 % of a film, where another
 * seed changes 19 %.
 */
#include "worker/render/render.h"
#include "tests/numerics/rows.h"
#include "tests/support/chains.h"
#include "tests/support/placed_scene.h"
#include "tests/support/stats.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = PLACED_SCENE_SIDE };

static struct world *make_world(double scale, double offset)
{
	return placed_scene_make(scale, offset, "<bsdf type='roughdielectric'><float name='alpha' value='0.1'/></bsdf>",
				 "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf>");
}

static void render(struct world *w, uint64_t seed, struct chains_result *out)
{
	struct chains_options options = {.min_depth = 1,
					 .max_depth = 6,
					 .chains = 64,
					 .bootstrap = 4096,
					 .steps = 2000 / test_scale(),
					 .seed = seed};
	chains_run(w, &options, out);
	world_free(w);
}

/* Returns the sum of the absolute differences over the sum; films are in units of b. */
static double relative_difference(const struct chains_result *a, const struct chains_result *b)
{
	double deviation = 0, sum = 0;
	for (int i = 0; i < 3 * SIDE * SIDE; i++) {
		deviation += fabs((double)a->xyz[i] * a->normalization - (double)b->xyz[i] * b->normalization);
		sum += (double)b->xyz[i] * b->normalization;
	}
	return deviation / sum;
}

static void test_same(void **state)
{
	(void)state;
	static const struct {
		const char *name;
		double scale, translation;
		bool is_exact;
	} cases[] = {
		{"in units 2^-13 as large", 0x1p-13, 0, true},
		{"in units 2^13 as large", 0x1p13, 0, true},
		{"moved by 1024", 1, 1024, true},
		{"scaled by 1e-4", 1e-4, 0, false},
		{"scaled by 1e4", 1e4, 0, false},
		{"moved by 1e5", 1, 100000.1, false},
		{"scaled by 1e-4, moved by 1", 1e-4, 1, false},
		{"scaled by 1e4, moved by 1e9", 1e4, 1e9, false},
	};
	struct rows rows = {0, 0};
	static struct chains_result original, reseeded, moved;
	uint64_t seed = stats_seed("the same scene");
	char measured[200];
	render(make_world(1, 0), seed, &original);
	render(make_world(1, 0), seed + 1, &reseeded);
	double noise = relative_difference(&reseeded, &original);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		render(make_world(cases[i].scale, cases[i].translation), seed, &moved);
		double film_difference = relative_difference(&moved, &original),
		       b = moved.normalization / original.normalization - 1;
		snprintf(measured, sizeof measured,
			 "film differs by %.2g of itself, b by %.1g (another seed: %.2g, %.1g)", film_difference, b,
			 noise, reseeded.normalization / original.normalization - 1);
		bool ok =
			cases[i].is_exact ? film_difference == 0 && b == 0 : film_difference <= 0.01 && fabs(b) < 1e-3;
		rows_add(&rows, "same image", cases[i].name, measured,
			 cases[i].is_exact ? "the same bits" : "film 0.01, b 1e-3", ok);
		free(moved.xyz);
	}
	free(original.xyz);
	free(reseeded.xyz);
	printf("the same scene elsewhere: %u cases, %u failed\n", rows.cases, rows.failed);
	assert_int_equal(rows.failed, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_same)};
	return cmocka_run_group_tests_name("same image", tests, NULL, NULL);
}
