/* SPDX-License-Identifier: Apache-2.0 */
/* The error that a canvas estimates: its interval covers the true error, and the distances between groups are correct.
 */
#include "common/estimate/canvas_image.h"

#include "common/base/mem.h"
#include "common/estimate/canvas_blocks.h"
#include "common/estimate/merge.h"
#include "tests/support/canvas_batches.h"

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <string.h>
#include <cmocka.h>

static double group_offset; /* offset shared by all pixels of a group: the effect of an error of b */
static double pixel_noise;

static float noisy_value(void)
{
	return (float)(4 * (1 + group_offset + pixel_noise * canvas_random_normal()));
}

/* 400 images with known true relMSE, 16 groups: the upper end must be above the truth in 95 % of the runs, and the
 * estimate's mean must equal the truth. Level: an interval that covers 92 % or more (the Satterthwaite approximation
 * may cost that much) fails the limit of 85 % with a probability below 1e-6; the mean of 400 estimates has a standard
 * error of at most 1.8 %, so a deviation of 10 % has a probability below 1e-7. Power: a coverage of 78 % (without an
 * interval it is about 50 %) is found with more than 99.9 %. Errors common to all pixels are the hard case. */
static void estimated_error_covers_the_truth(void **unused)
{
	(void)unused;
	struct plan p = canvas_test_plan(PLAN_SAMPLES, 6, 6, 16, 1);
	for (int correlated = 0; correlated < 2; correlated++) {
		double deviation = 0.08, truth = 0, mean_estimate = 0;
		int covered_count = 0;
		enum { RUNS = 400 };
		/* The mean of 16 groups has a variance of deviation^2/16 per pixel, relative to B = 1, equal in X, Y
		 * and Z when correlated; the expected relMSE is compared with (rgb - truth)^2 realised over the runs.
		 */
		for (int run = 0; run < RUNS; run++) {
			struct canvas *c;
			struct canvas_image img;
			canvas_random_state = (uint64_t)(run * 2 + correlated + 1) * UINT64_C(0x9e3779b97f4a7c15);
			assert_int_equal(canvas_new(&c, &p, -28, NULL, NULL), 0);
			for (uint32_t g = 0; g < 16; g++) {
				group_offset = correlated ? deviation * canvas_random_normal() : 0;
				pixel_noise = correlated ? 0 : deviation;
				struct batch b = canvas_test_batch(&p, 0, g, 0, 1, noisy_value);
				assert_int_equal(canvas_add(c, &b, NULL), 0);
				batch_fini(&b);
			}
			assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
			double exact[3] = {3.2404541621141054 - 1.5371385127977166 - 0.4985314095560162,
					   -0.9692660305051868 + 1.8760108454466942 + 0.0415560175303498,
					   0.0556434309591147 - 0.2040259135167538 + 1.0572251882231791};
			double variance = 0;
			const double m[3][3] = {{3.2404541621141054, 1.5371385127977166, 0.4985314095560162},
						{0.9692660305051868, 1.8760108454466942, 0.0415560175303498},
						{0.0556434309591147, 0.2040259135167538, 1.0572251882231791}};
			for (int k = 0; k < 3; k++) {
				double square = correlated ? exact[k] * exact[k]
							   : m[k][0] * m[k][0] + m[k][1] * m[k][1] + m[k][2] * m[k][2];
				variance += deviation * deviation / 16 * square / (exact[k] * exact[k]) / 3;
			}
			truth = variance;
			covered_count += img.rel_mse_upper >= truth;
			mean_estimate += img.rel_mse / RUNS;
			canvas_image_fini(&img);
			canvas_free(c);
		}
		print_message("correlated %d: covered %d of %d, mean estimate / truth %.4f\n", correlated,
			      covered_count, RUNS, mean_estimate / truth);
		assert_true(covered_count >= 340);
		assert_true(fabs(mean_estimate / truth - 1) < 0.1);
	}
}

static void black_canvas_has_no_error(void **unused)
{
	(void)unused;
	struct plan p = canvas_test_plan(PLAN_CHAINS, 4, 4, 2, 1);
	struct canvas *c;
	struct canvas_image img;
	assert_int_equal(canvas_new(&c, &p, -32, NULL, NULL), 0);
	for (uint32_t g = 0; g < 2; g++) {
		struct batch b = canvas_test_batch(&p, 0, g, 0, 0, canvas_test_one);
		b.independent_sum = 0;
		b.counters[COUNT_SAMPLES] = 0;
		assert_int_equal(canvas_add(c, &b, NULL), 0);
		batch_fini(&b);
	}
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	assert_true(img.is_black && img.b == 0 && isnan(img.rel_mse) && img.rounds == 1);
	struct plan with_target = p;
	with_target.target_error = 0.1;
	assert_int_equal(merge_find_end(&with_target, 1, 0, &img), MERGE_CONTINUES);
	canvas_image_fini(&img);
	canvas_free(c);
}

static float value_near_one(void)
{
	return (float)(1 + 0.02 * canvas_random_uniform());
}

/* A group's distance under any weights, computed here from the values that were put into its film only; the sum over
 * groups is that of the squared errors. */
static void group_distances_sum_to_the_squared_errors(void **unused)
{
	(void)unused;
	enum { GROUPS = 4, VALUES = 100 * 70 * 3 };
	static const double rgb_of_xyz[3][3] = {{3.2404541621141054, -1.5371385127977166, -0.4985314095560162},
						{-0.9692660305051868, 1.8760108454466942, 0.0415560175303498},
						{0.0556434309591147, -0.2040259135167538, 1.0572251882231791}};
	for (int kind = PLAN_SAMPLES; kind <= PLAN_CHAINS; kind++) {
		struct plan p = canvas_test_plan((enum plan_kind)kind, 100, 70, GROUPS, 1);
		struct canvas *c;
		struct canvas_image img;
		double(*rgb)[VALUES] = mem_alloc(GROUPS, sizeof *rgb), *weight = mem_alloc(VALUES, sizeof *weight);
		double distance[GROUPS], expected[GROUPS] = {0}, total = 0, squares = 0;
		canvas_random_state = 78;
		assert_int_equal(canvas_new(&c, &p, -32, NULL, NULL), 0);
		for (uint32_t g = 0; g < GROUPS; g++) {
			struct batch b = canvas_test_batch(&p, 0, g, 0, 4, value_near_one);
			b.independent_sum = (1 + 0.01 * g) * (double)p.epoch;
			double scale = 1 / (double)p.epoch;
			if (kind == PLAN_CHAINS) {
				struct batch boot = {.key = {1, LEASE_BOOTSTRAP, g, 0, 0},
						     .independent_sum = 8 * (1 - 0.02 * g)};
				boot.counters[COUNT_INDEPENDENT] = boot.counters[COUNT_SAMPLES] = 8;
				assert_int_equal(canvas_add(c, &boot, NULL), 0);
				scale = (b.independent_sum + boot.independent_sum) / (double)(8 + p.epoch) /
					(double)b.counters[COUNT_SAMPLES];
			}
			for (size_t t = 0; t < 4; t++)
				for (size_t i = 0; i < (size_t)b.tiles[t].width * b.tiles[t].height * 9; i++) {
					size_t pixel = i / 9, x = b.tiles[t].x - 3 + pixel % b.tiles[t].width,
					       y = b.tiles[t].y - 2 + pixel / b.tiles[t].width;
					rgb[g][(y * 100 + x) * 3 + i / 3 % 3] +=
						scale * rgb_of_xyz[i / 3 % 3][i % 3] *
						(double)b.tiles[t].xyz[3 * pixel + i % 3];
				}
			assert_int_equal(canvas_add(c, &b, NULL), 0);
			batch_fini(&b);
		}
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		for (size_t i = 0; i < VALUES; i++) {
			double mean = (rgb[0][i] + rgb[1][i] + rgb[2][i] + rgb[3][i]) / GROUPS;
			weight[i] = canvas_random_uniform();
			squares += weight[i] * (double)img.error[i] * (double)img.error[i];
			for (int g = 0; g < GROUPS; g++)
				expected[g] += weight[i] * (rgb[g][i] - mean) * (rgb[g][i] - mean);
		}
		canvas_group_distances(c, weight, distance);
		for (int g = 0; g < GROUPS; g++) {
			total += distance[g];
			assert_true(fabs(distance[g] / expected[g] - 1) < 1e-6);
		}
		assert_true(fabs(total / (GROUPS * (GROUPS - 1) * squares) - 1) < 1e-6);
		mem_free(rgb);
		mem_free(weight);
		canvas_image_fini(&img);
		canvas_free(c);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(estimated_error_covers_the_truth),
		cmocka_unit_test(black_canvas_has_no_error),
		cmocka_unit_test(group_distances_sum_to_the_squared_errors),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
