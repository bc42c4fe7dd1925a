/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Moments of the weight of a brightness that is known with an error, against the midpoint rule over the brightness
 * itself, without statistics. The floor ranges from a thousandth of the error to a hundred errors.
 */
#include "common/estimate/inverse_square.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static struct inverse_square moments_by_midpoint_rule(double brightness, double error, double floor)
{
	const int points = 2000000;
	double one = 0, two = 0, width = 16.0 / points;
	for (int i = 0; i < points; i++) {
		double z = -8 + (i + 0.5) * width, b = brightness + error * z;
		double weight = 1 / (b * b + floor * floor), law = exp(-z * z / 2) / sqrt(2 * M_PI) * width;
		one += law * weight;
		two += law * weight * weight;
	}
	return (struct inverse_square){one, two - one * one};
}

static void moments_match_the_midpoint_rule(void **state)
{
	(void)state;
	static const double floors[] = {0.001, 0.03, 0.4, 1, 7, 100}, brightnesses[] = {-4.5, -0.7, 0, 0.2, 2, 5};
	const double error = 3e-3;
	for (size_t i = 0; i < 6; i++)
		for (size_t k = 0; k < 6; k++) {
			double f = floors[i] * error, b = brightnesses[k] * error;
			struct inverse_square got = inverse_square_moments(b, error, f),
					      is = moments_by_midpoint_rule(b, error, f);
			assert_true(fabs(got.mean / is.mean - 1) < 1e-3);
			assert_true(fabs(got.variance - is.variance) < 1e-3 * (is.variance + is.mean * is.mean));
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(moments_match_the_midpoint_rule)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
