/* SPDX-License-Identifier: Apache-2.0 */
/* Quantiles against tables of the F and chi-square distributions, and against closed forms. */
#include "common/estimate/quantile.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static void assert_near(double a, double b, double relative)
{
	if (!(fabs(a - b) <= relative * fabs(b)))
		fail_msg("%.12g is not %.12g", a, b);
}

/* Upper 2.5 % points as printed in tables of F, three or four digits. */
static void quantiles_match_printed_tables(void **state)
{
	(void)state;
	static const struct {
		double p, a, b, x, digits;
	} rows[] = {
		{0.975, 1, 1, 647.789, 1e-6},	{0.975, 1, 15, 6.1995, 1e-5},	{0.975, 2, 30, 4.1821, 2e-5},
		{0.975, 5, 10, 4.2361, 2e-5},	{0.975, 10, 20, 2.7737, 2e-5},	{0.975, 15, 15, 2.8621, 2e-5},
		{0.975, 30, 120, 1.6899, 4e-5}, {0.95, 4, 60, 2.5252, 3e-5},	{0.95, 1, 15, 4.5431, 2e-5},
		{0.99, 3, 45, 4.2492, 3e-5},	{0.95, 120, 120, 1.3519, 4e-5},
	};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		assert_near(f_quantile(rows[i].p, rows[i].a, rows[i].b), rows[i].x, rows[i].digits);
		assert_near(f_quantile(1 - rows[i].p, rows[i].b, rows[i].a), 1 / rows[i].x, rows[i].digits);
	}
}

static void quantiles_match_closed_forms(void **state)
{
	(void)state;
	/* Two degrees in the numerator: P(F < x) = 1 - (1 + 2 x / b)^(-b / 2). */
	for (double b = 1; b < 1e5; b *= 3.7)
		for (double p = 0.025; p < 1; p += 0.095)
			assert_near(f_quantile(p, 2, b), b / 2 * expm1(-2 / b * log1p(-p)), 1e-7);
	/* One degree each: (2 / pi) atan(sqrt(x)). */
	for (double x = 1e-6; x < 1e6; x *= 7)
		assert_near(f_cdf(x, 1, 1), 2 / 3.14159265358979323846 * atan(sqrt(x)), 1e-12);
	assert_true(f_cdf(0, 3, 4) == 0);
	/* Many degrees: F is near 1, with quantiles of a normal distribution. */
	double narrow = sqrt(2 / 1e6 * (1 + 1.0 / 15));
	assert_near((f_quantile(0.975, 1e6, 15e6) - 1) / narrow, 1.96, 3e-3);
	assert_near((1 - f_quantile(0.025, 1e6, 15e6)) / narrow, 1.96, 3e-3);
}

static void quantile_inverts_the_distribution(void **state)
{
	(void)state;
	for (double a = 1; a < 1e6; a *= 5.3)
		for (double p = 0.001; p < 1; p += 0.0713)
			assert_near(f_cdf(f_quantile(p, a, 15 * a), a, 15 * a), p, 1e-4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(quantiles_match_printed_tables),
		cmocka_unit_test(quantiles_match_closed_forms),
		cmocka_unit_test(quantile_inverts_the_distribution),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
