/* SPDX-License-Identifier: Apache-2.0 */
/* The brightness map: halves of the film show their own brightness, and a firefly is spread over its neighbourhood
 * instead of showing. Checked against the brightness of the samples, which are stratified over the film. */
#include "worker/render/path/brightness.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

enum { SIDE = 64, SAMPLES = 1 << 13 };
static const struct film_window window = {-2, 5, SIDE, SIDE};

/* Adds samples stratified over the window; each contributes the value of `of` at its position, divided by the density
 * 1 / pixels. */
static void add_samples(struct brightness *b, unsigned a_cell, double (*of)(double x, double y))
{
	struct error e;
	assert_int_equal(brightness_init(b, &window, SAMPLES, a_cell, &e), 0);
	for (int i = 0; i < SAMPLES; i++) {
		double x = i % 128 * 0.5 + 0.25, y = i / 128 + 0.5, value = of(x, y) * SIDE * SIDE;
		brightness_add(b, &(struct splat){window.x + x, window.y + y, {value / 2, value / 4, value / 4}}, 1);
		brightness_end_sample(b);
	}
}

static void fill_coarse_map(struct brightness *b, double (*of)(double x, double y))
{
	add_samples(b, BRIGHTNESS_SAMPLES_PER_CELL, of);
	brightness_compute_scales(b, SAMPLES);
}

/* 64 x 64 cells with two samples each, so that each cell covers one pixel. */
static void fill_fine_map(struct brightness *b, double (*of)(double x, double y))
{
	add_samples(b, 1, of);
	brightness_compute_nearby_scales(b, SAMPLES);
}

static double relative_brightness(const struct brightness *b, double x, double y)
{
	return brightness_inverse_at(b, window.x + x, window.y + y) * SIDE * SIDE;
}

static double value_of_two_halves(double x, double y)
{
	(void)y;
	return x < SIDE / 2 ? 10 : 0.5;
}

static void both_halves_have_their_brightness(void **state)
{
	(void)state;
	struct brightness b;
	fill_coarse_map(&b, value_of_two_halves);
	for (double y = 1; y < SIDE; y += 7)
		for (double x = 1; x < SIDE; x += 5) {
			double product = relative_brightness(&b, x, y) * value_of_two_halves(x, y);
			assert_true(product > 0.98 && product < 1.02); /* 1 % of the mean is added in quadrature */
		}
	brightness_fini(&b);
}

static double value_of_firefly(double x, double y)
{
	return x == 40.25 && y == 20.5 ? 1e6 : 1;
}

static void a_firefly_does_not_show(void **state)
{
	(void)state;
	struct brightness b;
	fill_coarse_map(&b, value_of_firefly);
	double there = relative_brightness(&b, 40.25, 20.5);
	assert_true(there == relative_brightness(&b, 3, 3) &&
		    there == relative_brightness(&b, 60,
						 60)); /* the mean of the whole film: no quarter is known well enough */
	assert_true(there > 0 && there < 0.01);
	brightness_fini(&b);
}

static double value_of_black(double x, double y)
{
	(void)x, (void)y;
	return 0;
}

static void a_black_film_has_no_scale(void **state)
{
	(void)state;
	struct brightness b;
	fill_coarse_map(&b, value_of_black);
	assert_true(relative_brightness(&b, 1, 1) == 0);
	brightness_fini(&b);
}

static double value_of_dark_half(double x, double y)
{
	(void)y;
	return x < SIDE / 2 ? 1 : 0;
}

static void darkness_has_the_smallest_measurable_brightness(void **state)
{
	(void)state;
	struct brightness b;
	fill_coarse_map(&b, value_of_dark_half);
	double min_brightness = 1 / relative_brightness(&b, 60, 30); /* a hundredth of the mean, which is 0.5 */
	assert_true(min_brightness > 0.00499 && min_brightness < 0.00501);
	brightness_fini(&b);
}

static void a_sample_counts_once_in_a_cell(void **state)
{
	(void)state;
	struct brightness b;
	struct error e;
	const struct splat here = {window.x, window.y, {1, 1, 1}}, there = {window.x + SIDE - 1, window.y, {1, 0, 0}};
	assert_int_equal(brightness_init(&b, &window, SAMPLES, 1, &e), 0);
	brightness_add(&b, &here, 2);
	brightness_add(&b, &there, 1);
	b.target.add_splat(&b.target, &here, 1.0 / (SIDE * SIDE)); /* adds 3 to the brightness */
	brightness_end_sample(&b);
	brightness_add(&b, &here, 1);
	brightness_end_sample(&b);
	assert_true(b.sum[0] == 9 + 3 && b.square_sum[0] == 9 * 9 + 3 * 3);
	assert_true(b.sum[b.resolution - 1] == 1 && b.square_sum[b.resolution - 1] == 1);
	brightness_fini(&b);
}

static void dark_places_beside_bright_ones_are_dark(void **state)
{
	(void)state;
	struct brightness b;
	fill_fine_map(&b, value_of_two_halves);
	for (double y = 0.5; y < SIDE; y += 7)
		for (double x = 0.5; x < SIDE; x++) {
			if (x > SIDE / 2 - 3 && x < SIDE / 2 + 3)
				continue; /* neighbourhoods of 5 x 5 cells reach across the border of the halves */
			double product = relative_brightness(&b, x, y) * value_of_two_halves(x, y);
			assert_true(product > 0.98 && product < 1.02);
		}
	brightness_fini(&b);
}

/* The neighbourhood of the firefly grows to 25 x 25 cells; neighbourhoods elsewhere are too small to contain the
 * firefly. */
static void a_firefly_is_spread_over_its_neighbourhood(void **state)
{
	(void)state;
	struct brightness b;
	fill_fine_map(&b, value_of_firefly);
	double there = 1 / relative_brightness(&b, 40.25, 20.5), expected = 1 + (1e6 - 1) / (2 * 25 * 25);
	assert_true(there > 0.999 * expected && there < 1.001 * expected);
	double distant_brightness = 1 / relative_brightness(&b, 60, 20.5), mean = 1 + (1e6 - 1) / SAMPLES;
	expected = sqrt(1 + 0.01 * mean * 0.01 * mean); /* 1 % of the mean is added in quadrature */
	assert_true(distant_brightness > 0.999 * expected && distant_brightness < 1.001 * expected);
	brightness_fini(&b);
}

static void a_black_film_has_no_scale_in_the_fine_map(void **state)
{
	(void)state;
	struct brightness b;
	fill_fine_map(&b, value_of_black);
	assert_true(relative_brightness(&b, 1, 1) == 0);
	brightness_fini(&b);
	fill_fine_map(&b, value_of_dark_half);
	double min_brightness = 1 / relative_brightness(&b, 60, 30);
	assert_true(min_brightness > 0.00499 && min_brightness < 0.00501);
	brightness_fini(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(both_halves_have_their_brightness),
		cmocka_unit_test(a_firefly_does_not_show),
		cmocka_unit_test(a_black_film_has_no_scale),
		cmocka_unit_test(darkness_has_the_smallest_measurable_brightness),
		cmocka_unit_test(a_sample_counts_once_in_a_cell),
		cmocka_unit_test(dark_places_beside_bright_ones_are_dark),
		cmocka_unit_test(a_firefly_is_spread_over_its_neighbourhood),
		cmocka_unit_test(a_black_film_has_no_scale_in_the_fine_map),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
