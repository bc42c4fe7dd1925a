/* SPDX-License-Identifier: Apache-2.0 */
/* The film of one lease: reconstruction filters are normalised, and a splat keeps its energy. Checked by quadrature,
 * and against values from Mitsuba 3's tests. */
#include "worker/render/film/sums.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

/* Every kernel that the reader accepts has integral 1, and splats distribute all of their energy. */
static void kernels_have_integral_1(void **state)
{
	(void)state;
	static const struct scene_settings cases[] = {
		{.filter = FILTER_BOX, .filter_radius = 0.5},
		{.filter = FILTER_BOX, .filter_radius = 2},
		{.filter = FILTER_BOX, .filter_radius = 64},
		{.filter = FILTER_TENT, .filter_radius = 1},
		{.filter = FILTER_TENT, .filter_radius = 0.25},
		{.filter = FILTER_TENT, .filter_radius = 40},
		{.filter = FILTER_GAUSSIAN, .filter_radius = 2, .filter_stddev = 0.5},
		{.filter = FILTER_GAUSSIAN, .filter_radius = 1, .filter_stddev = 2},
		{.filter = FILTER_GAUSSIAN, .filter_radius = 64, .filter_stddev = 16},
		{.filter = FILTER_CUBIC, .filter_radius = 2, .filter_b = 1.0 / 3, .filter_c = 1.0 / 3},
		{.filter = FILTER_CUBIC, .filter_radius = 2, .filter_b = 0, .filter_c = 0.5},
		{.filter = FILTER_LANCZOS, .filter_radius = 3},
		{.filter = FILTER_LANCZOS, .filter_radius = 1},
	};
	struct plan p = {
		.width = 300, .height = 300, .crop_x = 20, .crop_y = 10, .crop_width = 260, .crop_height = 270};
	for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
		struct film_sums f;
		assert_int_equal(film_sums_init(&f, &p, &cases[k], NULL), 0);
		enum { N = 200000 };
		double sum = 0, r = cases[k].filter_radius;
		for (int i = 0; i < N; i++)
			sum += film_sums_kernel(&f, 1.01 * r * (2 * (i + 0.5) / N - 1)) * 2.02 * r / N;
		assert_true(fabs(sum - 1) < 1e-4);
		assert_true(film_sums_kernel(&f, 1.001 * r) == 0 && film_sums_kernel(&f, -1.001 * r) == 0);
		/* Averaged over all positions within a pixel, splats keep their energy. */
		double energy = 0, value[3] = {1, 2, 3};
		enum { PLACES = 40 };
		for (int i = 0; i < PLACES * PLACES; i++) {
			struct splat s = {150 + (i % PLACES + 0.5) / PLACES,
					  145 + (i / PLACES + 0.5) / PLACES,
					  {value[0], value[1], value[2]}};
			film_sums_splat(&f, &s, 1.0 / (PLACES * PLACES));
		}
		for (size_t i = 0; i < (size_t)f.width * f.height; i++)
			energy += f.xyz[3 * i + 1];
		if (!(fabs(energy / 2 - 1) < 2e-3))
			fail_msg("kernel %zu of radius %g splats %g of its energy", k, r, energy / 2);
		film_sums_fini(&f);
	}
}

/* Values from Mitsuba 3's tests, whose kernels are 1 in the middle or, like that of Mitchell and Netravali, have
 * integral 1. */
static void kernels_have_the_values_of_mitsuba(void **state)
{
	(void)state;
	static const struct {
		struct scene_settings s;
		double distance, value, slack;
	} cases[] = {
		{{.filter = FILTER_GAUSSIAN, .filter_radius = 2, .filter_stddev = 0.5}, 0.2, 0.9227, 1e-3},
		{{.filter = FILTER_LANCZOS, .filter_radius = 3}, 1.4, -0.14668, 1e-5},
		{{.filter = FILTER_CUBIC, .filter_radius = 2, .filter_b = 1.0 / 3, .filter_c = 1.0 / 3},
		 0,
		 0.8888,
		 1e-4},
		{{.filter = FILTER_TENT, .filter_radius = 1}, 0.1, 0.9, 1e-12},
		{{.filter = FILTER_BOX, .filter_radius = 0.5}, 0.49, 1, 0},
	};
	struct plan p = {.width = 8, .height = 8, .crop_width = 8, .crop_height = 8};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct film_sums f;
		assert_int_equal(film_sums_init(&f, &p, &cases[i].s, NULL), 0);
		double middle = cases[i].s.filter == FILTER_CUBIC ? 1 : film_sums_kernel(&f, 0),
		       value = film_sums_kernel(&f, cases[i].distance) / middle;
		if (!(fabs(value - cases[i].value) <= cases[i].slack))
			fail_msg("kernel %zu is %g at %g, not %g", i, value, cases[i].distance, cases[i].value);
		film_sums_fini(&f);
	}
}

/* The kernel of a panorama wraps around: a splat loses no energy, and the part beyond an edge arrives at the opposite
 * position. */
static void panorama_kernels_wrap_around(void **state)
{
	(void)state;
	enum { WIDTH = 40, HEIGHT = 20 };
	const struct scene_settings s = {.width = WIDTH,
					 .height = HEIGHT,
					 .border = 2,
					 .filter = FILTER_TENT,
					 .filter_radius = 2,
					 .projection = PROJECTION_SPHERE};
	struct plan p = {.width = WIDTH, .height = HEIGHT, .crop_width = WIDTH, .crop_height = HEIGHT};
	struct film_sums f;
	struct error e;
	static const struct {
		double x, y;
		uint32_t column, row; /* a pixel on the other side, at the distance 1 from the splat in one dimension */
	} cases[] = {{0.5, 10.5, WIDTH - 1, 10},
		     {WIDTH - 0.5, 10.5, 0, 10},
		     {3.5, 0.5, 23, 0},
		     {33.5, HEIGHT - 0.5, 13, HEIGHT - 1}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		assert_int_equal(film_sums_init(&f, &p, &s, &e), 0);
		film_sums_splat(&f, &(struct splat){cases[i].x, cases[i].y, {1, 1, 1}}, 1);
		double sum = 0, arrived = f.xyz[3 * (cases[i].row * WIDTH + cases[i].column)];
		for (size_t k = 0; k < (size_t)WIDTH * HEIGHT; k++)
			sum += f.xyz[3 * k];
		if (!(fabs(sum - 1) < 1e-12 && fabs(arrived - 0.25 * 0.5) < 1e-12))
			fail_msg("%zu: %g in all, %g there", i, sum, arrived);
		film_sums_fini(&f);
	}
	/* A window may lie inside the panorama or go all the way round; otherwise some of the light would be missing.
	 */
	static const struct {
		uint32_t x, y, width, height;
		bool valid;
	} windows[] = {{2, 2, 36, 16, true}, {0, 5, WIDTH, 4, true}, {0, 0, WIDTH, 4, true}, {1, 5, 20, 4, false},
		       {5, 1, 20, 4, false}, {5, 5, 34, 4, false},   {0, 0, WIDTH, 1, false}};
	for (size_t i = 0; i < sizeof windows / sizeof *windows; i++) {
		p.crop_x = windows[i].x;
		p.crop_y = windows[i].y;
		p.crop_width = windows[i].width;
		p.crop_height = windows[i].height;
		int rc = film_sums_init(&f, &p, &s, &e);
		if ((rc == 0) != windows[i].valid)
			fail_msg("window %zu: %d", i, rc);
		if (!rc)
			film_sums_fini(&f);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(kernels_have_integral_1),
		cmocka_unit_test(kernels_have_the_values_of_mitsuba),
		cmocka_unit_test(panorama_kernels_wrap_around),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
