/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The colour matching functions and the wavelengths sampled from them: published sums, the density against the shares
 * of wavelengths below given ones, unbiased XYZ for four wavelengths and fewer, and means and weights against sums
 * computed independently. The draws are seeded.
 */
#include "common/base/color.h"
#include "worker/render/math/cie.h"
#include "worker/render/math/spectrum.h"

#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

/* The sums that the publishers give as a check. */
static void matching_functions_have_their_published_sums(void **state)
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

/* Returns the unnormalised density at a tabulated wavelength: the sum of the magnitudes of the matching functions of
 * linear Rec. 709. */
static double unnormalised_density(int i)
{
	double rgb[3];
	rec709_from_xyz(cie_observer[i], rgb);
	return fabs(rgb[0]) + fabs(rgb[1]) + fabs(rgb[2]);
}

/* Returns the share of wavelengths below nm: the integral of the density over whole cells of 1 nm, by the trapezoid
 * rule. */
static double share_below(double nm)
{
	double total = 0, below = 0;
	for (int i = 0; i + 1 < CIE_COUNT; i++) {
		double area = 0.5 * (unnormalised_density(i) + unnormalised_density(i + 1));
		total += area;
		below += area * fmin(1, fmax(0, nm - CIE_FIRST_NM - i));
	}
	return 0.95 * below / total + 0.05 * (nm - WAVELENGTH_MIN) / (WAVELENGTH_MAX - WAVELENGTH_MIN);
}

static const double corner_case_us[] = {0, 0x1p-53, 1e-4, 0.1, 0.25, 0.5 - 0x1p-54, 0.5, 0.75, 0.9, 1 - 0x1p-53};
enum { CORNER_CASE_US = sizeof corner_case_us / sizeof *corner_case_us };

/* The shares below the four wavelengths are a quarter apart, and the share below the hero wavelength is u. */
static void wavelengths_are_a_quarter_of_the_density_apart(void **state)
{
	(void)state;
	for (size_t n = 0; n < CORNER_CASE_US; n++) {
		struct wavelengths w = wavelengths_sample(corner_case_us[n]);
		assert_false(w.is_grey);
		assert_true(w.u == corner_case_us[n]);
		for (int i = 0; i < SPECTRUM_LANES; i++) {
			double want = corner_case_us[n] + 0.25 * i;
			assert_true(w.nm[i] >= WAVELENGTH_MIN && w.nm[i] <= WAVELENGTH_MAX);
			assert_true(fabs(share_below(w.nm[i]) - (want - floor(want))) < 1e-12);
		}
	}
}

static void density_is_the_derivative_of_the_share(void **state)
{
	(void)state;
	double sum = 0, total = 0;
	for (int i = 0; i + 1 < CIE_COUNT; i++)
		total += 0.5 * (unnormalised_density(i) + unnormalised_density(i + 1));
	for (int i = 0; i + 1 < CIE_COUNT; i++) {
		double nm = CIE_FIRST_NM + i, pdf = wavelength_pdf(nm + 0.5);
		double want = 0.95 * 0.5 * (unnormalised_density(i) + unnormalised_density(i + 1)) / total +
			      0.05 / (CIE_COUNT - 1);
		assert_true(wavelength_pdf(nm) == pdf && wavelength_pdf(nm + 0.999) == pdf);
		assert_true(fabs(pdf / want - 1) < 1e-9);
		sum += pdf;
	}
	assert_true(fabs(sum - 1) < 1e-12);
	assert_true(wavelength_pdf(WAVELENGTH_MAX) > 0.05 / (CIE_COUNT - 1));
}

/* The purpose of the density: the relative variance of the three channels of one white splat is small. Uniform
 * wavelengths would have 0.61, 0.17, 0.67. */
static void test_white_has_little_colour_noise(void **state)
{
	(void)state;
	enum { N = 2000 };
	double sum[3] = {0}, square[3] = {0};
	for (int n = 0; n < N; n++) {
		struct wavelengths w = wavelengths_sample((n + 0.5) / (SPECTRUM_LANES * N));
		double xyz[3], rgb[3];
		spectrum l;
		for (int i = 0; i < SPECTRUM_LANES; i++)
			l.v[i] = cie_d65[(int)(w.nm[i] - CIE_FIRST_NM)];
		spectrum_to_xyz(l, &w, xyz);
		rec709_from_xyz(xyz, rgb);
		for (int k = 0; k < 3; k++) {
			sum[k] += rgb[k] / N;
			square[k] += rgb[k] * rgb[k] / N;
		}
	}
	const double max_variance[3] = {0.07, 0.03, 0.02};
	for (int k = 0; k < 3; k++) {
		double variance = square[k] / (sum[k] * sum[k]) - 1;
		print_message("channel %d: relative variance %.4f\n", k, variance);
		assert_true(variance < max_variance[k]);
	}
}

/* A smooth spectrum far from flat, and its colour by the trapezoid rule at 1 nm. */
static double bump_spectrum(double nm)
{
	return 0.2 + 3 * exp(-(nm - 610) * (nm - 610) / 1800);
}

static void fewer_wavelengths_start_at_the_hero(void **state)
{
	(void)state;
	for (size_t n = 0; n < CORNER_CASE_US; n++) {
		double u = corner_case_us[n];
		struct wavelengths all = wavelengths_sample_distinct(u, 4), old = wavelengths_sample(u);
		struct wavelengths one = wavelengths_sample_distinct(u, 1), two = wavelengths_sample_distinct(u, 2);
		assert_memory_equal(all.nm, old.nm, sizeof all.nm);
		assert_true(all.period == 0 && old.period == 0 && one.period == 1 && two.period == 2);
		for (int i = 0; i < SPECTRUM_LANES; i++) {
			assert_true(one.nm[i] == old.nm[0]);
			assert_true(two.nm[i] == two.nm[i % 2]);
		}
		assert_true(two.nm[0] == old.nm[0] && two.nm[1] == old.nm[2]);
	}
}

/* The mean over u, by the midpoint rule, is the colour itself. */
static void check_mean_xyz(unsigned count)
{
	enum { N = 40000 };
	double exact[3] = {0}, mean[3] = {0};
	for (int i = 0; i < CIE_COUNT; i++)
		for (int k = 0; k < 3; k++)
			exact[k] += cie_observer[i][k] * bump_spectrum(CIE_FIRST_NM + i) / CIE_Y_SUM;
	for (int n = 0; n < N; n++) {
		double xyz[3];
		struct wavelengths w = wavelengths_sample_distinct((n + 0.5) / N, count);
		spectrum s;
		for (int k = 0; k < SPECTRUM_LANES; k++)
			s.v[k] = bump_spectrum(w.nm[k]);
		spectrum_to_xyz(s, &w, xyz);
		for (int k = 0; k < 3; k++)
			mean[k] += xyz[k] / N;
	}
	for (int k = 0; k < 3; k++) {
		print_message("%u wavelengths, channel %d: %.7f, exact %.7f\n", count, k, mean[k], exact[k]);
		assert_true(fabs(mean[k] / exact[k] - 1) < 5e-5);
	}
}

static void test_xyz_is_unbiased(void **state)
{
	(void)state;
	check_mean_xyz(4);
	check_mean_xyz(2);
	check_mean_xyz(1);
}

/* X + Y + Z in one step, for lanes that are wavelengths and for lanes that are R, G and B, where the fourth lane does
 * not count. */
static void intensity_is_x_plus_y_plus_z_in_one_step(void **state)
{
	(void)state;
	const struct wavelengths all[] = {
		wavelengths_sample(0.3), wavelengths_sample_distinct(0.7, 2), {.is_rgb = true}};
	const spectrum l = {{0.3, 1.7, 0.9, 5}};
	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		spectrum weights = spectrum_intensity_weights(&all[k]);
		double xyz[3], rgb[3], sum = 0;
		spectrum_to_xyz(l, &all[k], xyz);
		for (int i = 0; i < SPECTRUM_LANES; i++)
			sum += l.v[i] * weights.v[i];
		assert_true(fabs(sum / (xyz[0] + xyz[1] + xyz[2]) - 1) < 1e-12);
		rec709_from_xyz(xyz, rgb);
		for (int i = 0; i < 3 && all[k].is_rgb; i++)
			assert_true(fabs(rgb[i] - l.v[i]) < 1e-14);
	}
}

/* The mean of lanes, also if their sum exceeds the largest double; where the sum is finite, the mean is a quarter of
 * it, bit by bit. */
static void mean_of_lanes_does_not_overflow(void **state)
{
	(void)state;
	assert_true(spectrum_mean(spectrum_constant(DBL_MAX)) == DBL_MAX);
	for (int i = 1; i < 1000; i++) {
		const spectrum s = {{1.0 / i, i / 7.0, sqrt(i), exp(0.1 * i)}};
		assert_true(spectrum_mean(s) == (((s.v[0] + s.v[1]) + s.v[2]) + s.v[3]) / 4);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(matching_functions_have_their_published_sums),
		cmocka_unit_test(wavelengths_are_a_quarter_of_the_density_apart),
		cmocka_unit_test(density_is_the_derivative_of_the_share),
		cmocka_unit_test(test_white_has_little_colour_noise),
		cmocka_unit_test(fewer_wavelengths_start_at_the_hero),
		cmocka_unit_test(test_xyz_is_unbiased),
		cmocka_unit_test(intensity_is_x_plus_y_plus_z_in_one_step),
		cmocka_unit_test(mean_of_lanes_does_not_overflow),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
