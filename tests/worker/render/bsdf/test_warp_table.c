/* SPDX-License-Identifier: Apache-2.0 */
/* Warps of bilinear densities are inverted exactly, and their Jacobian is the density. */
#include "tests/support/stats.h"
#include "worker/render/bsdf/warp_table.h"
#include "worker/render/math/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { WIDTH = 5, HEIGHT = 4, PHI = 3, THETA = 2, NODES = WIDTH * HEIGHT, SLICES = PHI * THETA };

static const double phi[PHI] = {-1, 0.5, 2}, theta[THETA] = {0, 1};
static const struct warp_axes axes = {{PHI, THETA}, {phi, theta}};

static struct warp_table table;
static struct arena arena;

static int make_table(void **state)
{
	(void)state;
	static double value[SLICES * NODES];
	for (uint64_t i = 0; i < SLICES * NODES; i++) {
		double u[4];
		rng_uniform4(stats_seed("warp"), RNG_TEST, i, 0, 0, u);
		value[i] = u[0] < 0.3 ? 0 : u[1] * (double)(1 + i / NODES); /* slices with different sums */
	}
	return warp_table_init(&table, SLICES, WIDTH, HEIGHT, value, &arena);
}

static int free_table(void **state)
{
	(void)state;
	arena_fini(&arena);
	return 0;
}

static void mixture_weights_interpolate_slices(void **state)
{
	(void)state;
	static const struct {
		double at[2];
		int count;
		double first; /* the weight of `slice` */
		uint32_t slice;
	} cases[] = {
		{{-5, -5}, 1, 1, 0},	 {{9, 9}, 1, 1, 5},	    {{0.5, 0}, 1, 1, 2},	 {{0.5, 1}, 1, 1, 3},
		{{-0.25, 0}, 2, 0.5, 2}, {{0.5, 0.25}, 2, 0.75, 2}, {{1.25, 0.25}, 4, 0.125, 5},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct warp_mix m = warp_mix_at(&axes, cases[i].at);
		double found = 0, sum = 0;
		assert_int_equal(m.count, cases[i].count);
		for (int k = 0; k < m.count; k++) {
			sum += m.weight[k];
			found += m.slice[k] == cases[i].slice ? m.weight[k] : 0;
		}
		assert_true(fabs(found - cases[i].first) < 1e-15 && fabs(sum - 1) < 1e-15);
	}
	const struct warp_axes one = {{1, 1}, {phi, theta}};
	struct warp_mix m = warp_mix_at(&one, (const double[2]){7, 7});
	assert_true(m.count == 1 && m.slice[0] == 0 && m.weight[0] == 1);
}

static void inverse_is_exact_and_its_jacobian_is_the_density(void **state)
{
	(void)state;
	int compared = 0;
	for (uint64_t i = 0; i < 2000; i++) {
		double u[4], p[4], warped[2], back[2], right[2], up[2], step = 1e-6;
		rng_uniform4(stats_seed(__func__), RNG_TEST, i, 0, 0, u);
		rng_uniform4(stats_seed(__func__), RNG_TEST, i, 1, 0, p);
		struct warp_mix m = warp_mix_at(&axes, (const double[2]){4 * p[0] - 1.5, 1.4 * p[1] - 0.2});
		double density = warp_table_sample(&table, &m, u, warped);
		assert_true(warped[0] >= 0 && warped[0] <= 1 && warped[1] >= 0 && warped[1] <= 1);
		double same = warp_table_invert(&table, &m, warped, back);
		assert_true(fabs(same - density) <= 1e-9 * (1 + density));
		assert_true(fabs(warp_table_density(&table, &m, warped) - same) <= 1e-12 * (1 + density));
		assert_true(fabs(back[0] - u[0]) < 1e-9 && fabs(back[1] - u[1]) < 1e-9);
		/* Inside a cell, where the inverse is smooth. */
		double x = fmod(warped[0] * (WIDTH - 1), 1), y = fmod(warped[1] * (HEIGHT - 1), 1);
		if (fmin(fmin(x, 1 - x), fmin(y, 1 - y)) < 1e-3 || density < 1e-2)
			continue;
		warp_table_invert(&table, &m, (const double[2]){warped[0] + step, warped[1]}, right);
		warp_table_invert(&table, &m, (const double[2]){warped[0], warped[1] + step}, up);
		double area = ((right[0] - back[0]) * (up[1] - back[1]) - (right[1] - back[1]) * (up[0] - back[0])) /
			      (step * step);
		if (!(fabs(area / density - 1) < 1e-3))
			fail_msg("at (%g, %g): %g, density %g", warped[0], warped[1], area, density);
		compared++;
	}
	assert_true(compared > 1500);
}

/* The integral over the square is 1 for every mixture, by the midpoint rule on cells cut into 8 x 8, which is exact for
 * functions linear in each direction. */
static void every_mixture_integrates_to_one(void **state)
{
	(void)state;
	enum { CUT = 8, X = CUT * (WIDTH - 1), Y = CUT * (HEIGHT - 1) };
	for (int i = 0; i < 9; i++) {
		struct warp_mix m = warp_mix_at(&axes, (const double[2]){i / 3 - 0.7, 0.4 * (i % 3)});
		double sum = 0;
		for (int y = 0; y < Y; y++)
			for (int x = 0; x < X; x++)
				sum += warp_table_density(&table, &m, (const double[2]){(x + 0.5) / X, (y + 0.5) / Y});
		assert_true(fabs(sum / (X * Y) - 1) < 1e-12);
	}
}

static void corners_of_the_square_are_mapped(void **state)
{
	(void)state;
	struct warp_mix m = warp_mix_at(&axes, (const double[2]){0, 0.5});
	for (int i = 0; i < 4; i++) {
		const double u[2] = {i % 2, i / 2};
		double warped[2], back[2];
		warp_table_sample(&table, &m, u, warped);
		assert_true(fabs(warped[1] - u[1]) < 1e-6);
		warp_table_invert(&table, &m, u, back);
		assert_true(fabs(back[0] - u[0]) < 1e-12 && fabs(back[1] - u[1]) < 1e-12);
	}
}

static void invalid_tables_are_refused(void **state)
{
	(void)state;
	struct arena a = {.limit = 0};
	struct warp_table t;
	double zero[8] = {0}, minus[8] = {1, 1, 1, 1, 1, 1, -1, 1}, half[8] = {1, 1, 1, 1};
	assert_int_equal(warp_table_init(&t, 2, 2, 2, zero, &a), -22);
	assert_int_equal(warp_table_init(&t, 2, 2, 2, minus, &a), -22);
	assert_int_equal(warp_table_init(&t, 2, 2, 2, half, &a), -22); /* the second slice is 0 everywhere */
	assert_int_equal(warp_table_init(&t, 1, 2, 2, half, &a), 0);
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(mixture_weights_interpolate_slices),
		cmocka_unit_test(inverse_is_exact_and_its_jacobian_is_the_density),
		cmocka_unit_test(every_mixture_integrates_to_one),
		cmocka_unit_test(corners_of_the_square_are_mapped),
		cmocka_unit_test(invalid_tables_are_refused),
	};
	return cmocka_run_group_tests_name("warp_table", tests, make_table, free_table);
}
