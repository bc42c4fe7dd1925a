/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Spectra made from colours have the same RGB under D65 within the tolerance of the fit, lie between 0 and 1
 * everywhere, and are constant for grey; emitters have their RGB; many bounces multiply spectra. Tables of values are
 * compared with a separate search.
 */
#include "worker/render/math/cie.h"
#include "worker/render/texture/color.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

typedef spectrum (*spectrum_function)(const void *user, const struct wavelengths *w);

static spectrum color_spectrum(const void *user, const struct wavelengths *w)
{
	return color_eval(user, w);
}

static spectrum table_spectrum(const void *user, const struct wavelengths *w)
{
	return color_eval_rgb_reflectance(user, w);
}

/* Computes the linear Rec. 709 of a spectrum, under D65 or without an illuminant, by a sum in steps of 1 nm. */
static void integrate_rgb(spectrum_function f, const void *user, bool under_d65, double rgb[3])
{
	double xyz[3] = {0};
	for (int i = 0; i < CIE_COUNT; i += SPECTRUM_LANES) {
		struct wavelengths w = {.is_grey = false};
		for (int k = 0; k < SPECTRUM_LANES; k++)
			w.nm[k] = fmin(CIE_FIRST_NM + i + k, CIE_LAST_NM);
		spectrum s = f(user, &w);
		for (int k = 0; k < SPECTRUM_LANES && i + k < CIE_COUNT; k++)
			for (int c = 0; c < 3; c++)
				xyz[c] += s.v[k] * cie_observer[i + k][c] / CIE_Y_SUM *
					  (under_d65 ? color_d65(w.nm[k]) : 1);
	}
	/* The published matrix instead of the one that the fit uses. */
	const double rec709[3][3] = {{3.2404542, -1.5371385, -0.4985314},
				     {-0.9692660, 1.8760108, 0.0415560},
				     {0.0556434, -0.2040259, 1.0572252}};
	for (int r = 0; r < 3; r++) {
		rgb[r] = 0;
		for (int c = 0; c < 3; c++)
			rgb[r] += rec709[r][c] * xyz[c];
	}
}

static double fit_error(const double rgb[3], bool table)
{
	double back[3], worst = 0;
	struct color color;
	assert_int_equal(color_from_rgb(rgb, COLOR_REFLECTANCE, &color), 0);
	if (table)
		integrate_rgb(table_spectrum, rgb, true, back);
	else
		integrate_rgb(color_spectrum, &color, true, back);
	for (int k = 0; k < 3; k++)
		worst = fmax(worst, fabs(back[k] - rgb[k]));
	return worst;
}

/* The ratios of components in this grid lie between the nodes of the table. */
static void test_rgb_survives_the_round_trip(void **state)
{
	(void)state;
	double worst[2] = {0}, sum[2] = {0};
	int count = 0;
	for (int i = 0; i < 11 * 11 * 11; i++, count++) {
		const double rgb[3] = {i % 11 / 10.0, i / 11 % 11 / 10.0, i / 121 / 10.0};
		for (int t = 0; t < 2; t++) {
			double e = fit_error(rgb, t);
			worst[t] = fmax(worst[t], e);
			sum[t] += e;
		}
	}
	for (int t = 0; t < 2; t++)
		print_message("%s: largest error %.2e, mean %.2e\n", t ? "table" : "fit", worst[t], sum[t] / count);
	/* 2e-6 is due to the difference between the published matrix and the table's white. */
	assert_true(worst[0] < 1e-4);
	assert_true(worst[1] < 0.005);
}

static void test_dark_and_saturated_colours_keep_their_rgb(void **state)
{
	(void)state;
	const double colours[][3] = {{1e-9, 0, 0},
				     {0, 1e-4, 1e-5},
				     {1, 0, 0},
				     {0, 1, 0},
				     {0, 0, 1},
				     {1, 1, 0},
				     {0, 1, 1},
				     {1, 0, 1},
				     {1, 0.999999, 1},
				     {1e-300, 0, 1e-301},
				     {0.5, 0.5, 0.5 + 1e-12}};
	for (size_t i = 0; i < sizeof colours / sizeof *colours; i++)
		for (int t = 0; t < 2; t++)
			assert_true(fit_error(colours[i], t) < 0.005);
}

static void test_grey_is_constant(void **state)
{
	(void)state;
	const double greys[] = {0, 1e-12, 0.18, 0.5, 1};
	for (size_t i = 0; i < sizeof greys / sizeof *greys; i++) {
		const double rgb[3] = {greys[i], greys[i], greys[i]};
		struct color c;
		assert_int_equal(color_from_rgb(rgb, COLOR_REFLECTANCE, &c), 0);
		assert_int_equal(c.kind, COLOR_KIND_CONSTANT);
		for (double u = 0; u < 1; u += 0.01) {
			struct wavelengths w = wavelengths_sample(u);
			assert_true(spectrum_max(color_eval(&c, &w)) == greys[i]);
			assert_true(spectrum_max(color_eval_rgb_reflectance(rgb, &w)) == greys[i]);
		}
		assert_true(color_max(&c) == greys[i]);
		assert_true(fabs(color_mean(&c) - greys[i]) <= 1e-15);
		assert_int_equal(color_from_rgb(rgb, COLOR_ILLUMINANT, &c), 0);
		assert_int_equal(c.kind, COLOR_KIND_D65);
		const struct wavelengths grey = {.is_grey = true};
		assert_true(spectrum_max(color_eval(&c, &grey)) == greys[i]);
	}
}

static void test_emitters_give_their_rgb(void **state)
{
	(void)state;
	const double colours[][3] = {{1, 1, 1}, {17, 12, 4}, {1420, 1552, 1642}, {1, 0, 0}, {0.2, 0.9, 0.1}};
	for (size_t i = 0; i < sizeof colours / sizeof *colours; i++) {
		struct color c;
		double rgb[3], scale = fmax(colours[i][0], fmax(colours[i][1], colours[i][2]));
		assert_int_equal(color_from_rgb(colours[i], COLOR_ILLUMINANT, &c), 0);
		integrate_rgb(color_spectrum, &c, false, rgb);
		for (int k = 0; k < 3; k++)
			assert_true(fabs(rgb[k] - colours[i][k]) < 1e-3 * scale);
	}
	double y = 0;
	for (int i = 0; i < CIE_COUNT; i++)
		y += cie_observer[i][1] * color_d65(CIE_FIRST_NM + i) / CIE_Y_SUM;
	assert_true(fabs(y - 1) < 1e-5);
	/* The Rec. 709 values of a constant spectrum without an illuminant, which is reddish. */
	struct color flat = color_constant(1);
	double rgb[3];
	integrate_rgb(color_spectrum, &flat, false, rgb);
	assert_true(fabs(rgb[0] - 1.205) < 1e-3 && fabs(rgb[1] - 0.948) < 1e-3 && fabs(rgb[2] - 0.909) < 1e-3);
}

struct bounces {
	struct color color;
	int count;
};

static spectrum reflected_spectrum(const void *user, const struct wavelengths *w)
{
	const struct bounces *b = user;
	spectrum s = spectrum_constant(1);
	for (int i = 0; i < b->count; i++)
		s = spectrum_mul(s, color_eval(&b->color, w));
	return s;
}

/* Estimates RGB like paths do, from the four lanes of sampled wavelengths. */
static void estimate_rgb(const struct bounces *b, double rgb[3])
{
	enum { SAMPLE_COUNT = 1 << 14 };
	double xyz[3] = {0};
	for (int i = 0; i < SAMPLE_COUNT; i++) {
		const struct wavelengths w = wavelengths_sample((i + 0.5) / SAMPLE_COUNT);
		double one[3];
		spectrum s = reflected_spectrum(b, &w);
		for (int k = 0; k < SPECTRUM_LANES; k++)
			s.v[k] *= color_d65(w.nm[k]);
		spectrum_to_xyz(s, &w, one);
		for (int k = 0; k < 3; k++)
			xyz[k] += one[k] / SAMPLE_COUNT;
	}
	const double rec709[3][3] = {{3.2404542, -1.5371385, -0.4985314},
				     {-0.9692660, 1.8760108, 0.0415560},
				     {0.0556434, -0.2040259, 1.0572252}};
	for (int r = 0; r < 3; r++)
		rgb[r] = rec709[r][0] * xyz[0] + rec709[r][1] * xyz[1] + rec709[r][2] * xyz[2];
}

/*
 * Saturated reflectances under an emitter of rgb 1: the sampled estimate agrees with the integral to 0.1 %, and one
 * bounce gives the colour of the scene. n bounces multiply spectra, not colours, as in reality; a renderer that
 * multiplies R, G and B gives another result (docs/method.md).
 */
static void test_bounces_multiply_spectra(void **state)
{
	(void)state;
	const double colours[][3] = {
		{0.1, 0.5, 0.1}, {0.05, 0.8, 0.05}, {0.63, 0.065, 0.05}, {0.14, 0.45, 0.091}, {0.1, 0.1, 0.6}};
	for (size_t i = 0; i < sizeof colours / sizeof *colours; i++) {
		int main_channel = colours[i][1] > colours[i][0] ? 1 : 0;
		main_channel = colours[i][2] > colours[i][main_channel] ? 2 : main_channel;
		double own = colours[i][main_channel], ratio[3];
		for (int n = 1; n <= 3; n++) {
			struct bounces b = {.count = n};
			double sum[3], drawn[3];
			assert_int_equal(color_from_rgb(colours[i], COLOR_REFLECTANCE, &b.color), 0);
			integrate_rgb(reflected_spectrum, &b, true, sum);
			estimate_rgb(&b, drawn);
			for (int k = 0; k < 3; k++)
				assert_true(fabs(drawn[k] - sum[k]) < 1e-3 * sum[main_channel]);
			ratio[n - 1] = sum[main_channel] / pow(own, n);
		}
		print_message("(%g %g %g): after one, two, three bounces %.4f %.4f %.4f times the product of colours\n",
			      colours[i][0], colours[i][1], colours[i][2], ratio[0], ratio[1], ratio[2]);
		assert_true(fabs(ratio[0] - 1) < 1e-3);
		/* Likewise under a constant spectrum, which is reddish. */
		struct bounces once = {.count = 1};
		double flat[3], under[3];
		struct color even = color_constant(1);
		assert_int_equal(color_from_rgb(colours[i], COLOR_REFLECTANCE, &once.color), 0);
		integrate_rgb(color_spectrum, &even, false, flat);
		integrate_rgb(reflected_spectrum, &once, false, under);
		double reddish = under[main_channel] / (flat[main_channel] * own);
		print_message("  under a constant spectrum %.4f times\n", reddish);
		assert_true(fabs(reddish - 1) < 0.05);
	}
}

static spectrum unbounded_spectrum(const void *rgb, const struct wavelengths *w)
{
	return color_eval_rgb_unbounded(rgb, w);
}

static void test_unbounded_colours_keep_their_rgb(void **state)
{
	(void)state;
	const double k[3] = {3.91295, 2.45285, 2.14219};
	struct color c;
	double rgb[3];
	assert_int_equal(color_from_rgb(k, COLOR_UNBOUNDED, &c), 0);
	integrate_rgb(color_spectrum, &c, true, rgb);
	for (int i = 0; i < 3; i++)
		assert_true(fabs(rgb[i] - k[i]) < 1e-4 * k[0]);
	/* likewise in textures */
	integrate_rgb(unbounded_spectrum, k, true, rgb);
	for (int i = 0; i < 3; i++)
		assert_true(fabs(rgb[i] - k[i]) < COLOR_UNBOUNDED_SCALE * 0.005 * k[0]); /* error of the table */
	const struct wavelengths w = wavelengths_sample(0.1);
	const double grey[3] = {7, 7, 7}, black[3] = {0, 0, 0};
	assert_true(color_eval_rgb_unbounded(grey, &w).v[0] == 7);
	assert_true(color_eval_rgb_unbounded(black, &w).v[0] == 0);
}

static void test_reflectances_stay_within_their_bounds(void **state)
{
	(void)state;
	const double colours[][3] = {{0.9, 0.1, 0.3}, {0.1, 0.2, 0.05}, {0.3, 0.3, 0.9}};
	for (size_t i = 0; i < sizeof colours / sizeof *colours; i++)
		for (int role = COLOR_REFLECTANCE; role <= COLOR_UNBOUNDED; role++) {
			struct color c;
			double largest = 0;
			assert_int_equal(color_from_rgb(colours[i], (enum color_role)role, &c), 0);
			for (double u = 0; u < 0.25; u += 1e-4) {
				struct wavelengths w = wavelengths_sample(u);
				largest = fmax(largest, spectrum_max(color_eval(&c, &w)));
			}
			assert_true(largest <= color_max(&c) * (1 + 1e-12));
			assert_true(color_max(&c) < (role == COLOR_ILLUMINANT ? 2.5 : 1.001) * largest);
		}
}

/* If wavelengths repeat, each lane has the value of its wavelength alone. */
static void test_repeated_wavelengths_have_equal_values(void **state)
{
	(void)state;
	const double rgb[3] = {0.9, 0.1, 0.3};
	for (int role = COLOR_REFLECTANCE; role <= COLOR_UNBOUNDED; role++)
		for (unsigned count = 1; count <= 2; count++)
			for (double u = 0; u < 1; u += 0.01) {
				struct color c;
				assert_int_equal(color_from_rgb(rgb, (enum color_role)role, &c), 0);
				struct wavelengths w = wavelengths_sample_distinct(u, count), each = w;
				each.period = 0;
				spectrum few = color_eval(&c, &w), all = color_eval(&c, &each);
				assert_memory_equal(&few, &all, sizeof few);
				assert_true(few.v[0] == few.v[2] && few.v[1] == few.v[3]);
			}
}

static struct value make_table(const double *nm, const double *x, uint32_t n)
{
	return (struct value){.type = VALUE_SPECTRUM, .as.spectrum = {.count = n, .nm = nm, .value = x}};
}

static void test_tables_are_interpolated(void **state)
{
	(void)state;
	struct arena arena = {0};
	struct error e;
	const double nm[] = {400, 410, 500, 700}, x[] = {0.1, 0.3, 0.2, 0.8};
	struct value v = make_table(nm, x, 4);
	struct color c;
	/* Beyond a table the value is 0, as in Mitsuba, except for unbounded quantities. */
	for (int role = COLOR_REFLECTANCE; role <= COLOR_UNBOUNDED; role++) {
		assert_int_equal(color_from_value(&v, (enum color_role)role, &arena, &c, &e), 0);
		struct wavelengths w = {.nm = {360, 405, 600, 830}};
		spectrum s = color_eval(&c, &w);
		bool ends = role == COLOR_UNBOUNDED;
		assert_true(fabs(s.v[1] - 0.2) < 1e-15 && fabs(s.v[2] - 0.5) < 1e-15);
		assert_true(s.v[0] == (ends ? 0.1 : 0) && s.v[3] == (ends ? 0.8 : 0));
		assert_true(color_max(&c) == 0.8);
		const double infrared[] = {830.5, 1000}, ultraviolet[] = {200, 359.5};
		v = make_table(infrared, x, 2);
		assert_int_equal(color_from_value(&v, (enum color_role)role, &arena, &c, &e), 0);
		assert_true(color_max(&c) == (ends ? 0.3 : 0));
		v = make_table(ultraviolet, x, 2);
		assert_int_equal(color_from_value(&v, (enum color_role)role, &arena, &c, &e), 0);
		assert_true(color_max(&c) == (ends ? 0.3 : 0));
		v = make_table(nm, x, 4);
	}
	/* Values of Mitsuba 3's tests of `irregular`, from 450 nm in steps of 50 nm. */
	const double three[] = {500, 600, 650}, value[] = {1, 2, 0.5}, known[] = {0, 1, 1.5, 2, 0.5, 0};
	v = make_table(three, value, 3);
	assert_int_equal(color_from_value(&v, COLOR_ILLUMINANT, &arena, &c, &e), 0);
	for (int i = 0; i < 6; i++) {
		double at = 450 + 50 * i;
		assert_true(color_eval(&c, &(struct wavelengths){.nm = {at, at, at, at}}).v[0] == known[i]);
	}

	const double even[] = {0.25};
	v = make_table(NULL, even, 1);
	assert_int_equal(color_from_value(&v, COLOR_REFLECTANCE, &arena, &c, &e), 0);
	assert_int_equal(c.kind, COLOR_KIND_CONSTANT);
	assert_int_equal(color_from_value(&v, COLOR_ILLUMINANT, &arena, &c, &e), 0);
	assert_int_equal(c.kind, COLOR_KIND_CONSTANT);
	arena_fini(&arena);
}

/* A linear search through the table. */
static double search_table(const double *nm, const double *x, uint32_t n, double at)
{
	if (at <= nm[0])
		return x[0];
	for (uint32_t i = 1; i < n; i++)
		if (at <= nm[i])
			return x[i - 1] + (x[i] - x[i - 1]) * ((at - nm[i - 1]) / (nm[i] - nm[i - 1]));
	return x[n - 1];
}

/* Equal spectra have one table, however many materials have them. */
static void test_equal_tables_are_shared(void **state)
{
	(void)state;
	enum { POINTS = 60000, COLOURS = 1000 };
	static double nm[POINTS], value[2][POINTS];
	struct arena a = {0};
	struct error e;
	struct color first, c;
	for (int i = 0; i < POINTS; i++) {
		nm[i] = 360 + 0.008 * i;
		value[0][i] = value[1][i] = i % 7 / 7.0;
	}
	struct value v = {.type = VALUE_SPECTRUM, .as.spectrum = {.count = POINTS, .nm = nm, .value = value[0]}};
	assert_int_equal(color_from_value(&v, COLOR_REFLECTANCE, &a, &first, &e), 0);
	for (int i = 0; i < COLOURS; i++) {
		v.as.spectrum.value = value[i % 2];
		assert_int_equal(color_from_value(&v, COLOR_REFLECTANCE, &a, &c, &e), 0);
		assert_true(c.nm == first.nm && c.value == first.value);
	}
	assert_true(a.used < 3 * sizeof nm);
	value[1][POINTS / 3] = 0.75;
	v.as.spectrum.value = value[1];
	assert_int_equal(color_from_value(&v, COLOR_REFLECTANCE, &a, &c, &e), 0);
	assert_true(c.nm == first.nm && c.value != first.value && c.value[POINTS / 3] == 0.75);
	arena_fini(&a);
}

/* Equidistant tables, one with intervals of all sizes, and one with samples that nearly coincide. */
static void test_tables_with_uneven_intervals_are_searched(void **state)
{
	(void)state;
	const double even[] = {350, 450, 550, 650, 750, 850}, uneven[] = {390, 391, 500, 500.5, 612, 820},
		     close[] = {500, 500 + 1e-13, 501, 502, 503, 504};
	const double *nm[] = {even, uneven, close}, x[] = {0.1, 0.3, 0.2, 0.8, 0, 1}, y[] = {3, 0, 7, 2, 2, 5};
	struct arena arena = {0};
	struct error e;
	for (int k = 0; k < 3; k++)
		for (unsigned few = 0; few <= 2; few++)
			for (double u = 0; u < 1; u += 1.0 / 512) {
				struct value va = make_table(nm[k], x, 6), vb = make_table(nm[k], y, 6);
				struct color a, b;
				assert_int_equal(color_from_value(&va, COLOR_UNBOUNDED, &arena, &a, &e), 0);
				assert_int_equal(color_from_value(&vb, COLOR_UNBOUNDED, &arena, &b, &e), 0);
				a.scale = 0.5;
				b.nm = u < 0.5 ? a.nm : b.nm; /* like the tables of metals */
				struct wavelengths w = wavelengths_sample_distinct(u, few ? few : SPECTRUM_LANES);
				spectrum out[2], sa = color_eval(&a, &w), sb = color_eval(&b, &w);
				color_eval_pair(&a, &b, &w, out);
				for (int i = 0; i < SPECTRUM_LANES; i++) {
					assert_true(fabs(sa.v[i] - 0.5 * search_table(nm[k], x, 6, w.nm[i])) < 1e-12);
					assert_true(fabs(sb.v[i] - search_table(nm[k], y, 6, w.nm[i])) < 1e-11);
				}
				assert_memory_equal(&out[0], &sa, sizeof sa);
				assert_memory_equal(&out[1], &sb, sizeof sb);
			}
	arena_fini(&arena);
}

static void test_bad_values_are_refused(void **state)
{
	(void)state;
	struct arena arena = {0};
	struct error e;
	struct color c;
	const double backwards[] = {500, 400}, negative[] = {0.1, -0.1}, bright[] = {0.5, 1.5}, nm[] = {400, 500};
	const struct value reflectances[] = {
		{.type = VALUE_RGB, .as.rgb = {0.5, -0.1, 0.5}},
		{.type = VALUE_RGB, .as.rgb = {0.5, 1.1, 0.5}},
		{.type = VALUE_RGB, .as.rgb = {0.5, NAN, 0.5}},
		{.type = VALUE_FLOAT, .as.number = 1.5},
		{.type = VALUE_INT, .as.integer = -1},
		{.type = VALUE_STRING, .as.string = "red"},
		make_table(backwards, nm, 2),
		make_table(nm, negative, 2),
		make_table(nm, bright, 2),
		make_table(NULL, NULL, 0),
	};
	for (size_t i = 0; i < sizeof reflectances / sizeof *reflectances; i++)
		assert_int_equal(color_from_value(&reflectances[i], COLOR_REFLECTANCE, &arena, &c, &e), -EINVAL);
	const struct value infinite = {.type = VALUE_RGB, .as.rgb = {1, INFINITY, 1}};
	assert_int_equal(color_from_value(&infinite, COLOR_ILLUMINANT, &arena, &c, &e), -EINVAL);
	arena_fini(&arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_rgb_survives_the_round_trip),
		cmocka_unit_test(test_dark_and_saturated_colours_keep_their_rgb),
		cmocka_unit_test(test_grey_is_constant),
		cmocka_unit_test(test_emitters_give_their_rgb),
		cmocka_unit_test(test_bounces_multiply_spectra),
		cmocka_unit_test(test_unbounded_colours_keep_their_rgb),
		cmocka_unit_test(test_reflectances_stay_within_their_bounds),
		cmocka_unit_test(test_repeated_wavelengths_have_equal_values),
		cmocka_unit_test(test_tables_are_interpolated),
		cmocka_unit_test(test_tables_with_uneven_intervals_are_searched),
		cmocka_unit_test(test_equal_tables_are_shared),
		cmocka_unit_test(test_bad_values_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
