/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/exact_sum.h"

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <float.h>
#include <string.h>
#include <cmocka.h>

static uint64_t random_state = 88172645463325252u;

static uint64_t next_random(void)
{
	random_state ^= random_state << 13;
	random_state ^= random_state >> 7;
	return random_state ^= random_state << 17;
}

static double random_double(int lowest, int highest)
{
	int exponent = lowest + (int)(next_random() % (uint64_t)(highest - lowest + 1));
	double m = 1 + (double)(next_random() >> 12) * 0x1p-52;
	return ldexp(next_random() & 1 ? m : -m, exponent);
}

static void sum_of_one_value_is_the_value(void **unused)
{
	(void)unused;
	const double special[] = {0,	     1,		 -1,	  DBL_MIN,  -DBL_MIN,
				  0x1p-1074, -0x1p-1074, DBL_MAX, -DBL_MAX, 0x1.fffffffffffffp-1023};
	for (size_t i = 0; i < sizeof special / sizeof *special; i++) {
		struct exact_sum s = {0};
		assert_true(exact_sum_add(&s, special[i]));
		assert_true(exact_sum_value(&s) == special[i]);
	}
	for (int i = 0; i < 100000; i++) {
		struct exact_sum s = {0};
		double x = random_double(-1070, 1023);
		exact_sum_add(&s, x);
		assert_true(exact_sum_value(&s) == x);
	}
}

static void large_values_cancel(void **unused)
{
	(void)unused;
	struct exact_sum s = {0};
	exact_sum_add(&s, 1e300);
	exact_sum_add(&s, 1e-300);
	exact_sum_add(&s, -1e300);
	assert_true(exact_sum_value(&s) == 1e-300);
	exact_sum_add(&s, -1e-300);
	assert_true(exact_sum_value(&s) == 0);
}

static void sum_is_rounded_once_to_nearest_even(void **unused)
{
	(void)unused;
	/* 1 + 2^-53 is a tie, rounded down to even; adding 2^-1074 puts it above the tie. 1 + 3 x 2^-53 is a tie,
	 * rounded up to even. */
	struct exact_sum s = {0};
	exact_sum_add(&s, 1);
	exact_sum_add(&s, 0x1p-53);
	assert_true(exact_sum_value(&s) == 1);
	exact_sum_add(&s, 0x1p-1074);
	assert_true(exact_sum_value(&s) == 1 + 0x1p-52);
	exact_sum_add(&s, -0x1p-1074);
	exact_sum_add(&s, 0x1p-52);
	assert_true(exact_sum_value(&s) == 1 + 0x1p-51);
}

static void small_sums_agree_with_long_integers(void **unused)
{
	(void)unused;
	struct exact_sum s = {0};
	__int128 reference = 0;
	for (int i = 0; i < 100000; i++) {
		int64_t v = (int64_t)(next_random() >> 11) * (next_random() & 1 ? 1 : -1);
		exact_sum_add(&s, (double)v);
		reference += v;
		assert_true(exact_sum_value(&s) == (double)reference);
	}
}

static void order_and_grouping_do_not_matter(void **unused)
{
	(void)unused;
	enum { N = 2000 };
	double x[N];
	struct exact_sum forward = {0}, backward = {0}, halves[2] = {{{0}}};
	for (int i = 0; i < N; i++)
		x[i] = random_double(-500, 500);
	for (int i = 0; i < N; i++) {
		exact_sum_add(&forward, x[i]);
		exact_sum_add(&backward, x[N - 1 - i]);
		exact_sum_add(&halves[i & 1], x[i]);
	}
	exact_sum_merge(&halves[0], &halves[1]);
	assert_memory_equal(&forward, &backward, sizeof forward);
	assert_memory_equal(&forward, &halves[0], sizeof forward);
}

static void infinities_and_nans_are_refused(void **unused)
{
	(void)unused;
	struct exact_sum s = {0}, empty = {0};
	assert_false(exact_sum_add(&s, INFINITY));
	assert_false(exact_sum_add(&s, -INFINITY));
	assert_false(exact_sum_add(&s, NAN));
	assert_memory_equal(&s, &empty, sizeof s);
}

/* A carry propagates through words with all bits set. */
static void carries_cross_all_words(void **unused)
{
	(void)unused;
	struct exact_sum a = {{UINT64_MAX, UINT64_MAX, UINT64_MAX, 4}}, b = {{1, 0, 0, 0}};
	exact_sum_merge(&a, &b);
	assert_true(a.words[0] == 0 && a.words[1] == 0 && a.words[2] == 0 && a.words[3] == 5);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sum_of_one_value_is_the_value),
		cmocka_unit_test(large_values_cancel),
		cmocka_unit_test(carries_cross_all_words),
		cmocka_unit_test(sum_is_rounded_once_to_nearest_even),
		cmocka_unit_test(small_sums_agree_with_long_integers),
		cmocka_unit_test(order_and_grouping_do_not_matter),
		cmocka_unit_test(infinities_and_nans_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
