/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The tail index, of Pareto samples, whose index is known, and of the largest values that are kept. Level and power:
 * for each index the mean of 64 independent estimates with k = 128 has a relative standard error of 1.1 % (Hill's
 * estimate follows k a / Gamma(k): mean a k / (k - 1), coefficient of variation 1 / sqrt(k - 2)). The bound is 4.5
 * standard errors, two-sided level 7e-6 each; a bias of 7 % is found with more than 95 %. The limit that rules out an
 * index: the number of 4,000 estimates from samples of a Pareto law of index 2 that exceed it, against the law of the
 * estimate, Gamma(k), integrated by Simpson's rule: within 4.5 standard errors, and near 5 % where k is large.
 */
#include "common/estimate/tail.h"
#include "worker/render/math/rng.h"

#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static double pareto_deviate(uint64_t seed, uint64_t i, double index)
{
	double u[4];
	rng_uniform4(seed, RNG_TEST, i, 0, 0, u);
	return pow(1 - u[0], -1 / index);
}

static void index_of_a_pareto_law_is_estimated(void **state)
{
	(void)state;
	enum { TIMES = 64, SAMPLES = 2048, K = 128 };
	static const double indices[] = {0.5, 1, 1.5, 2, 4};
	for (size_t n = 0; n < sizeof indices / sizeof *indices; n++) {
		double mean = 0;
		for (uint64_t k = 0; k < TIMES; k++) {
			struct tail t;
			assert_int_equal(tail_init(&t, K + 1), 0);
			for (uint64_t i = 0; i < SAMPLES; i++)
				tail_add(&t, pareto_deviate(7000 + k, i, indices[n]));
			tail_select_largest(&t);
			mean += tail_index(&t, K) / TIMES;
			tail_fini(&t);
		}
		double expected = indices[n] * K / (K - 1.0), error = expected / sqrt((K - 2.0) * TIMES);
		print_message("index %g: %.4f, expected %.4f +- %.4f\n", indices[n], mean, expected, error);
		assert_true(fabs(mean - expected) < 4.5 * error);
	}
}

/* Asymptotic variance of an estimate with k = 1 (Dekkers et al. 1989, corollary 3.2). */
static double evi_variance(double g)
{
	if (g >= 0)
		return 1 + g * g;
	double a = 1 - 2 * g, b = 1 - 3 * g, c = 1 - 4 * g;
	return (1 - g) * (1 - g) * a * (4 - 8 * a / b + (5 - 11 * g) * a / (b * c));
}

/* The extreme value index of Pareto laws is the inverse of their power, of the exponential law 0, and of the uniform
 * law -1. The bound is 4.5 standard errors plus 0.02 for bias, which is of the order of 1 / k and k / n, 0.008 each:
 * level 7e-6 or less each. 0.5 is told from 0.4 with a power of more than 95 %. */
static void extreme_value_index_is_estimated(void **state)
{
	(void)state;
	enum { TIMES = 64, SAMPLES = 16384, K = 128 };
	static const double expected[] = {2, 1, 0.5, 0.25, 0, -1};
	for (size_t n = 0; n < sizeof expected / sizeof *expected; n++) {
		double mean = 0, g = expected[n];
		for (uint64_t k = 0; k < TIMES; k++) {
			struct tail t;
			assert_int_equal(tail_init(&t, K + 1), 0);
			for (uint64_t i = 0; i < SAMPLES; i++) {
				double x = pareto_deviate(9000 + k, i, 1); /* 1 / x is uniformly distributed */
				tail_add(&t, g > 0 ? pow(x, g) : g < 0 ? 1 - 1 / x : log(x));
			}
			tail_select_largest(&t);
			mean += tail_extreme_value_index(&t, K) / TIMES;
			tail_fini(&t);
		}
		double error = sqrt(evi_variance(g) / (K * TIMES));
		print_message("extreme-value index %g: %.4f +- %.4f\n", g, mean, error);
		assert_true(fabs(mean - g) < 4.5 * error + 0.02);
	}
}

static void largest_values_are_kept(void **state)
{
	(void)state;
	struct tail t;
	assert_int_equal(tail_init(&t, 5), 0);
	for (int order = 0; order < 3; order++) {
		tail_clear(&t);
		for (int i = 0; i < 1000; i++)
			tail_add(&t, order == 0 ? i : order == 1 ? 999 - i : i * 373 % 1000);
		tail_select_largest(&t);
		assert_int_equal(t.count, 5);
		for (int i = 0; i < 5; i++)
			assert_true(t.values[i] == 999 - i);
	}
	tail_fini(&t);
}

static void too_few_or_equal_numbers_have_a_defined_index(void **state)
{
	(void)state;
	struct tail t;
	assert_int_equal(tail_init(&t, 4), 0);
	tail_select_largest(&t);
	assert_true(tail_index(&t, 0) == 1 && tail_index(&t, 3) == 1);
	assert_true(tail_extreme_value_index(&t, 0) == 1 && tail_extreme_value_index(&t, 3) == 1);
	for (int i = 0; i < 3; i++)
		tail_add(&t, 2);
	tail_select_largest(&t);
	assert_true(tail_index(&t, 3) == 1);
	assert_true(tail_index(&t, 2) == INFINITY);
	assert_true(tail_extreme_value_index(&t, 2) == -INFINITY);
	tail_add(&t, 1);
	tail_select_largest(&t);
	assert_true(fabs(tail_index(&t, 3) * log(2) - 1) < 1e-15);
	tail_fini(&t);
}

/* P(X < x) for X ~ Gamma(k), by Simpson's rule over the density. */
static double gamma_cdf(double k, double x)
{
	enum { STEPS = 20000 };
	double sum = 0, h = x / STEPS;
	for (int i = 1; i <= STEPS; i++) {
		double t = i * h, weight = i == STEPS ? 1 : i % 2 ? 4 : 2;
		sum += weight * exp((k - 1) * log(t) - t - lgamma(k));
	}
	return sum * h / 3;
}

static void true_index_is_ruled_out_in_one_of_twenty(void **state)
{
	(void)state;
	enum { TIMES = 4000 };
	static const size_t value_counts[] = {8, 32, 400};
	for (size_t n = 0; n < sizeof value_counts / sizeof *value_counts; n++) {
		size_t k = value_counts[n];
		double threshold = tail_index_critical(2, k), above = 0;
		for (uint64_t time = 0; time < TIMES; time++) {
			struct tail t;
			assert_int_equal(tail_init(&t, k + 1), 0);
			for (uint64_t i = 0; i <= k; i++) /* the estimate of k + 1 samples has the law of a larger
							   * sample */
				tail_add(&t, pareto_deviate(9000 + time, i, 2));
			tail_select_largest(&t);
			above += tail_index(&t, k) > threshold;
			tail_fini(&t);
		}
		double share = above / TIMES, expected = gamma_cdf((double)k, 2 * (double)k / threshold);
		print_message("k = %zu: %.4f of the estimates are above %.3f, expected %.4f\n", k, share, threshold,
			      expected);
		assert_true(fabs(share - expected) < 4.5 * sqrt(expected * (1 - expected) / TIMES));
		assert_true(k < 400 || fabs(expected - 0.05) < 0.015);
	}
	/* 32 of the errors of 16 x 16 pixels by 16 groups, 38,400 of 640 x 480 */
	assert_true(fabs(tail_index_critical(2, 32) - 2.58) < 0.005 &&
		    fabs(tail_index_critical(2, 38400) - 2.017) < 0.0005);
	assert_true(tail_index_critical(2, 0) == INFINITY);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(index_of_a_pareto_law_is_estimated),
		cmocka_unit_test(extreme_value_index_is_estimated),
		cmocka_unit_test(largest_values_are_kept),
		cmocka_unit_test(too_few_or_equal_numbers_have_a_defined_index),
		cmocka_unit_test(true_index_is_ruled_out_in_one_of_twenty),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
