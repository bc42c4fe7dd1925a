/* SPDX-License-Identifier: Apache-2.0 */
/* Fresnel's equations with a complex index, in complex arithmetic, at all angles of incidence. */
#include "worker/render/bsdf/fresnel.h"

#include <complex.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static double fresnel_by_complex_numbers(double c, double eta, double k)
{
	double complex n = eta - k * I, transmitted = csqrt(1 - (1 - c * c) / (n * n));
	double complex s = (c - n * transmitted) / (c + n * transmitted),
		       p = (n * c - transmitted) / (n * c + transmitted);
	return 0.5 * (creal(s) * creal(s) + cimag(s) * cimag(s) + creal(p) * creal(p) + cimag(p) * cimag(p));
}

/* Aluminium, gold, copper at green wavelengths; silver at blue ones; a weak absorber; an index close to glass. */
static void conductors_agree_with_complex_arithmetic(void **state)
{
	(void)state;
	const double metals[][2] = {{0.96, 6.7}, {0.36, 2.5}, {1.03, 2.59}, {0.15, 2.4}, {2.5, 0.3}, {1.5, 1e-4}};
	for (size_t m = 0; m < sizeof metals / sizeof *metals; m++)
		for (int i = 1; i <= 200; i++) {
			double c = i / 200.0, r = fresnel_conductor(c, metals[m][0], metals[m][1]);
			assert_true(fabs(r - fresnel_by_complex_numbers(c, metals[m][0], metals[m][1])) < 1e-12);
		}
	/* Away from normal incidence the value differs from that at normal incidence. */
	assert_true(fabs(fresnel_conductor(0.3, 0.36, 2.5) - fresnel_conductor(1, 0.36, 2.5)) > 0.005);
}

static void test_dielectrics_are_conductors_that_absorb_nothing(void **state)
{
	(void)state;
	for (int i = 1; i <= 200; i++)
		assert_true(fabs(fresnel_dielectric(i / 200.0, 1.5).reflectance -
				 fresnel_by_complex_numbers(i / 200.0, 1.5, 0)) < 1e-12);
}

/* A mirror, no boundary at all, and the largest numbers that scenes may give. */
static void extreme_conductors_reflect_as_expected(void **state)
{
	(void)state;
	const double ends[][3] = {{0, 1, 1},   {1, 0, 0},   {0, 0, 1},		 {1e9, 1e9, 1},
				  {0, 1e9, 1}, {1e9, 0, 1}, {1e-200, 1e-200, 1}, {1e-9, 1e9, 1}};
	for (size_t i = 0; i < sizeof ends / sizeof *ends; i++)
		for (int j = 0; j <= 100; j++) {
			double c = j / 100.0, r = fresnel_conductor(c, ends[i][0], ends[i][1]);
			assert_true(r >= 0 && r <= 1);
			if (j > 0 && j < 100)
				assert_true(fabs(r - ends[i][2]) < 1e-6);
		}
	assert_true(fresnel_conductor(0, 0.36, 2.5) == 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(conductors_agree_with_complex_arithmetic),
		cmocka_unit_test(extreme_conductors_reflect_as_expected),
		cmocka_unit_test(test_dielectrics_are_conductors_that_absorb_nothing),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
