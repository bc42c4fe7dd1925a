/* SPDX-License-Identifier: Apache-2.0 */
/* Statistics of accuracy measurements: Student's t against a printed table, a difference worked out by hand, the
 * coverage of intervals on simulated groups, medians, and the front of settings that no other setting dominates. */
#include "worker/cli/accuracy/accuracy_stats.h"

#include "tests/support/dice.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static void student_quantiles_match_the_table(void **unused)
{
	(void)unused;
	/* Two-sided 5 % quantiles, as in any printed table. */
	static const double degrees[] = {1, 2, 5, 15, 30, 1e9}, t[] = {12.706, 4.303, 2.571, 2.131, 2.042, 1.960};
	for (int i = 0; i < 6; i++)
		assert_true(fabs(stats_t_quantile(0.05, degrees[i]) - t[i]) < 6e-4);
}

static void difference_matches_that_by_hand(void **unused)
{
	(void)unused;
	const double a[] = {1, 2, 3, 4}, b[] = {2, 2, 2, 2}, one = 2, none = 0;
	double t;
	/* Mean 2.5, variance of the mean 5/12: a quarter above the other mean, standard deviation sqrt(5/12)/2, 3
	 * degrees of freedom (3.182). */
	struct interval d = stats_relative_difference(a, 4, b, 4, 0.05, &t),
			exact = stats_relative_difference(a, 4, &one, 1, 0.05, NULL);
	double half = 3.18245 * sqrt(5.0 / 12) / 2;
	assert_true(fabs(d.value - 0.25) < 1e-12 && fabs(d.low - (0.25 - half)) < 1e-4 &&
		    fabs(d.high - (0.25 + half)) < 1e-4);
	assert_true(fabs(t - 0.25 / (sqrt(5.0 / 12) / 2)) < 1e-9);
	assert_true(fabs(exact.low - d.low) < 1e-12);
	assert_true(isnan(stats_relative_difference(a, 4, &none, 1, 0.05, NULL).value));
}

/*
 * Differences of groups with unequal spread, at 95 %: of 4,000 intervals 3,800 contain the true value, with standard
 * deviation 14. A deviation of more than 75 (level 1e-6 by the normal approximation, with a margin for the error of
 * Welch's approximation) is a fault, such as ignoring the degrees of freedom (at 7 degrees, z instead of t misses 9 %).
 */
static void intervals_hold_the_truth(void **unused)
{
	(void)unused;
	struct dice d = dice_for_test("intervals_hold_the_truth");
	int held_count = 0;
	for (int k = 0; k < 4000; k++) {
		double a[8], b[8];
		for (int i = 0; i < 8; i++) {
			a[i] = 1.03 + 0.02 * dice_normal(&d);
			b[i] = 1 + 0.01 * dice_normal(&d);
		}
		struct interval x = stats_relative_difference(a, 8, b, 8, 0.05, NULL);
		held_count += x.low < 0.03 && 0.03 < x.high;
	}
	print_message("held by %d of 4,000\n", held_count);
	assert_true(held_count > 3800 - 75 && held_count < 3800 + 75);
}

static void median_and_its_interval_are_order_statistics(void **unused)
{
	(void)unused;
	double few[] = {3, 1, 2}, many[101];
	struct interval m = stats_median(few, 3);
	assert_true(m.value == 2 && m.low == 1 && m.high == 3);
	for (int i = 0; i < 101; i++)
		many[i] = (i * 37) % 101;
	m = stats_median(many, 101);
	assert_true(m.value == 50 && m.low == 40 && m.high == 60);
	assert_true(isnan(stats_median(few, 0).value));
}

static void front_has_the_settings_that_none_dominates(void **unused)
{
	(void)unused;
	const struct front_point p[] = {
		{log(10.0), 0.02, 0, 0, 0.01, false},	   /* the default */
		{log(10.2), 0.02, 0, 0, 0.01, false},	   /* not significantly slower */
		{log(14.0), 0.02, 0, 0, 0.01, false},	   /* significantly slower, no better */
		{log(5.0), 0.02, 0.05, 0.05, 0.07, false}, /* twice as fast, biased: a trade-off */
		{log(5.1), 0.02, 0.20, 0.20, 0.25, false}, /* equally fast, more biased */
		{log(9.9), 0.02, 0.03, 0.03, 0.05, false}, /* as fast as the default, biased */
		{log(7.0), 0.02, 0.06, 0.06, 0.08, false}, /* slower and no less biased than the fourth */
	};
	size_t dominators[7];
	stats_front(p, 7, 0.05, dominators);
	assert_true(dominators[0] == 0 && dominators[1] == 1 && dominators[3] == 3);
	assert_int_equal(dominators[2], 0);
	assert_int_equal(dominators[4], 3);
	assert_int_equal(dominators[5], 0);
	assert_int_equal(dominators[6], 3);
	const struct front_point wide[] = {{log(10.0), 0.3, 0, 0, 0.01, false},
					   {log(12.0), 0.3, 0, 0, 0.01, false},
					   {log(5.0), 0.3, 0, 0, 0.5, false}};
	stats_front(wide, 3, 0.05, dominators);
	assert_true(dominators[0] == 0 && dominators[1] == 1 && dominators[2] == 2);
	/* Faster, but suspected of bias, or with too large an uncertainty: neither dominates. */
	const struct front_point weak[] = {{log(10.0), 0.02, 0, 0, 0.5, false},
					   {log(5.0), 0.02, 0.03, 0, 0.5, false},
					   {log(5.0), 0.02, 0, 0, 0.9, false}};
	stats_front(weak, 3, 0.05, dominators);
	assert_true(dominators[0] == 0 && dominators[1] == 1 && dominators[2] == 2);
	/* Points known to make another image: they may be dominated, but dominate no other point. */
	const struct front_point other[] = {{log(10.0), 0.02, 0.01, 0, 0.05, false},
					    {log(5.0), 0.02, 0, 0, 0.05, true},
					    {log(20.0), 0.02, 0, 0, 0.05, true}};
	stats_front(other, 3, 0.05, dominators);
	assert_true(dominators[0] == 0 && dominators[1] == 1 && dominators[2] == 2);
	const struct front_point same[] = {{log(10.0), 0.02, 0, 0, 0.05, false}, {log(20.0), 0.02, 0, 0, 0.05, true}};
	stats_front(same, 2, 0.05, dominators);
	assert_true(dominators[0] == 0 && dominators[1] == 0);
	stats_front(p, 1, 0.05, dominators);
	assert_int_equal(dominators[0], 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(student_quantiles_match_the_table),
		cmocka_unit_test(difference_matches_that_by_hand),
		cmocka_unit_test(intervals_hold_the_truth),
		cmocka_unit_test(median_and_its_interval_are_order_statistics),
		cmocka_unit_test(front_has_the_settings_that_none_dominates),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
