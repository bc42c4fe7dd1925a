/* SPDX-License-Identifier: Apache-2.0 */
/* The statistics that other tests rely on, against published quantiles. */
#include "tests/support/stats.h"

#include "worker/render/math/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static void assert_p(double p, double expected)
{
	if (fabs(p - expected) > 2e-5 * expected)
		fail_msg("p = %.8g, published %g", p, expected);
}

static void p_values_agree_with_published_quantiles(void **state)
{
	(void)state;
	assert_p(stats_chi2_p(3.841459, 1), 0.05);
	assert_p(stats_chi2_p(5.991465, 2), 0.05);
	assert_p(stats_chi2_p(23.20925, 10), 0.01);
	assert_p(stats_chi2_p(124.3421, 100), 0.05);
	assert_p(stats_chi2_p(70.06489, 100), 0.99);
	assert_p(stats_student_t_p(12.70620, 1), 0.05);
	assert_p(stats_student_t_p(-2.131450, 15), 0.05);
	assert_p(stats_student_t_p(2.946713, 15), 0.01);
	assert_p(stats_student_t_p(1.959964, 1e9), 0.05);
	assert_p(stats_chi2_p(60, 2), exp(-30));
	assert_true(stats_student_t_p(0, 5) == 1 && stats_student_t_p(INFINITY, 5) == 0);
}

static void counts_are_tested_by_chi_square(void **state)
{
	(void)state;
	const double expected[5] = {100, 100, 1, 1, 98};
	assert_true(stats_counts_p((const uint64_t[]){100, 100, 1, 1, 98}, expected, 5) > 0.99);
	assert_p(stats_counts_p((const uint64_t[]){120, 80}, (const double[]){100, 100}, 2), stats_chi2_p(8, 1));
	assert_true(stats_counts_p((const uint64_t[]){130, 68, 1, 1, 100}, expected, 5) < 1e-3);
	assert_true(stats_counts_p((const uint64_t[]){100, 1}, (const double[]){101, 0}, 2) == 0);
}

/* p-values under a true hypothesis are uniform: 2,000 of them in ten bins, at level 1e-6. */
static void test_p_values_are_uniform(void **state)
{
	(void)state;
	uint64_t chi[10] = {0}, t[10] = {0};
	const double fair[16] = {50, 50, 50, 50, 50, 50, 50, 50, 50, 50, 50, 50, 50, 50, 50, 50};
	double tenths[10];
	for (uint64_t trial = 0; trial < 2000; trial++) {
		uint64_t counts[16] = {0};
		double means[16] = {0};
		for (uint64_t i = 0; i < 200; i++) {
			double u[4];
			rng_uniform4(stats_seed(__func__), RNG_TEST, trial, i, 0, u);
			for (int k = 0; k < 4; k++) {
				counts[(int)(16 * u[k])]++;
				means[i % 16] += u[k];
			}
		}
		for (int i = 0; i < 16; i++)
			means[i] /= i < 200 % 16 ? 52 : 48;
		chi[(int)fmin(9, 10 * stats_counts_p(counts, fair, 16))]++;
		t[(int)fmin(9, 10 * stats_mean_test(means, 16, 0.5).p)]++;
	}
	for (int i = 0; i < 10; i++)
		tenths[i] = 200;
	assert_true(stats_counts_p(chi, tenths, 10) > 1e-6);
	assert_true(stats_counts_p(t, tenths, 10) > 1e-6);
}

static void seed_is_a_hash_of_the_name(void **state)
{
	(void)state;
	assert_true(stats_seed("") == 0xcbf29ce484222325u && stats_seed("a") == 0xaf63dc4c8601ec8cu);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(p_values_agree_with_published_quantiles),
		cmocka_unit_test(counts_are_tested_by_chi_square),
		cmocka_unit_test(test_p_values_are_uniform),
		cmocka_unit_test(seed_is_a_hash_of_the_name),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
