#include "worker/math/cie.h"
#include "worker/math/rng.h"
#include "worker/math/spectrum.h"

#include "tests/support/stats.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

/* The sums that the publishers give for checking. */
static void test_published_sums(void **state)
{
	(void)state;
	double sum[3] = {0}, white[3] = {0};
	for (int i = 0; i < CIE_COUNT; i++)
		for (int k = 0; k < 3; k++) {
			sum[k] += cie_observer[i][k];
			white[k] += cie_observer[i][k] * cie_d65[i];
		}
	const double published[3] = {106.865, 106.857, 106.892};
	for (int k = 0; k < 3; k++)
		assert_true(fabs(sum[k] - published[k]) < 1e-3);
	double total = white[0] + white[1] + white[2];
	assert_true(fabs(white[0] / total - 0.3127) < 5e-5);
	assert_true(fabs(white[1] / total - 0.3290) < 5e-5);
	assert_true(cie_d65[560 - CIE_FIRST_NM] == 100);
}

static void test_wavelengths_in_range_and_apart(void **state)
{
	(void)state;
	const double us[] = {0, 0x1p-53, 0.25, 0.5 - 0x1p-54, 0.5, 0.75, 1 - 0x1p-53};
	for (size_t n = 0; n < sizeof us / sizeof *us; n++) {
		struct wavelengths w = wavelengths_sample(us[n]);
		assert_false(w.grey);
		for (int i = 0; i < SPECTRUM_LANES; i++) {
			assert_true(w.nm[i] >= WAVELENGTH_MIN && w.nm[i] <= WAVELENGTH_MAX);
			double gap = fabs(w.nm[i] - w.nm[(i + 1) % SPECTRUM_LANES]), range = WAVELENGTH_MAX - WAVELENGTH_MIN;
			assert_true(fabs(gap - range / 4) < 1e-9 || fabs(gap - range * 3 / 4) < 1e-9);
		}
	}
}

/* A smooth spectrum far from flat, and its colour by the trapezoid rule at 1 nm. */
static double bump(double nm)
{
	return 0.2 + 3 * exp(-(nm - 610) * (nm - 610) / 1800);
}

static void test_few_wavelengths(void **state)
{
	(void)state;
	const double us[] = {0, 0x1p-53, 0.25, 0.5 - 0x1p-54, 0.5, 0.75, 1 - 0x1p-53}, range = WAVELENGTH_MAX - WAVELENGTH_MIN;
	for (size_t n = 0; n < sizeof us / sizeof *us; n++) {
		struct wavelengths all = wavelengths_sample_few(us[n], 4), old = wavelengths_sample(us[n]);
		struct wavelengths one = wavelengths_sample_few(us[n], 1), two = wavelengths_sample_few(us[n], 2);
		assert_memory_equal(all.nm, old.nm, sizeof all.nm);
		assert_true(all.few == 0 && old.few == 0 && one.few == 1 && two.few == 2);
		for (int i = 0; i < SPECTRUM_LANES; i++) {
			assert_true(one.nm[i] == old.nm[0]);
			assert_true(two.nm[i] == two.nm[i % 2]);
		}
		assert_true(two.nm[0] == old.nm[0] && fabs(fabs(two.nm[1] - two.nm[0]) - range / 2) < 1e-9);
	}
}

/* 16 groups of 4,000 samples, of 60,000 where fewer wavelengths travel together; three t-tests at level 1e-6 each. The standard
 * error of Y is at most 0.4 %: a bias of 4 % would be found with certainty. */
static void unbiased_of(unsigned count)
{
	const uint64_t samples = count == 4 ? 4000 : 60000;
	double exact[3] = {0};
	for (int i = 0; i < CIE_COUNT; i++)
		for (int k = 0; k < 3; k++)
			exact[k] += cie_observer[i][k] * bump(CIE_FIRST_NM + i) / CIE_Y_SUM;
	enum { GROUPS = 16 };
	double means[3][GROUPS] = {{0}};
	uint64_t seed = stats_seed("test_xyz_is_unbiased") + 4 - count;
	for (uint64_t i = 0; i < GROUPS * samples; i++) {
		double u[4], xyz[3];
		rng_uniform4(seed, RNG_TEST, i, 0, 0, u);
		struct wavelengths w = wavelengths_sample_few(u[0], count);
		spectrum s;
		for (int k = 0; k < SPECTRUM_LANES; k++)
			s.v[k] = bump(w.nm[k]);
		spectrum_to_xyz(s, &w, xyz);
		for (int k = 0; k < 3; k++)
			means[k][i % GROUPS] += xyz[k] / (double)samples;
	}
	for (int k = 0; k < 3; k++) {
		struct stats_mean m = stats_mean_test(means[k], GROUPS, exact[k]);
		print_message("%u wavelengths, channel %d: %.6f +- %.6f, exact %.6f\n", count, k, m.mean, m.error, exact[k]);
		assert_true(m.p > 1e-6);
		assert_true(m.error < 0.005 * exact[k]);
		assert_true(stats_mean_test(means[k], GROUPS, 1.04 * exact[k]).p < 1e-6);
	}
}

static void test_xyz_is_unbiased(void **state)
{
	(void)state;
	unbiased_of(4);
	unbiased_of(2);
	unbiased_of(1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_published_sums),
		cmocka_unit_test(test_wavelengths_in_range_and_apart),
		cmocka_unit_test(test_few_wavelengths),
		cmocka_unit_test(test_xyz_is_unbiased),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
