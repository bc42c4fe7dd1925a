/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's film: the same bits in whatever order batches arrive, only complete rounds in the image, chains scaled by b,
 * blocks of groups that add up to the image, values beyond the grid counted instead of added, a bound on one lease's
 * share of a pixel, and an error without leaks for each failing allocation.
 */
#include "common/estimate/canvas_image.h"

#include "common/base/mem.h"
#include "common/estimate/canvas_blocks.h"
#include "common/estimate/merge.h"
#include "tests/support/canvas_batches.h"
#include "tests/support/failing_memory.h"
#include "tests/support/test_length.h"

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static float wide_range_value(void)
{
	double exponent = -30 + 42 * canvas_random_uniform(); /* 1e-30 .. 1e12 */
	return (float)((canvas_random_next() & 7 ? 1 : -1) * pow(10, exponent));
}

static void shuffle(uint32_t *order, uint32_t n)
{
	for (uint32_t i = n - 1; i > 0; i--) {
		uint32_t j = (uint32_t)(canvas_random_next() % (i + 1)), t = order[i];
		order[i] = order[j];
		order[j] = t;
	}
}

static int scaled_count(int n)
{
	return n / (int)test_scale();
}

static void bits_do_not_depend_on_the_order_of_batches(void **unused)
{
	(void)unused;
	/* 64 leases a round; rounds 2r and 2r+1 are open at the same time and arrive mixed. 10048 batches in all. */
	enum { LEASES = 64 };
	struct plan p = canvas_test_plan(PLAN_SAMPLES, 5, 4, 16, 4);
	struct canvas_image first = {0};
	for (int order_seed = 0; order_seed < 3; order_seed++) {
		struct canvas *c;
		assert_int_equal(canvas_new(&c, &p, -8, order_seed == 2 ? "/tmp" : NULL, NULL), 0);
		for (int pair = 0; pair < scaled_count(79); pair++) {
			struct batch batches[2 * LEASES];
			uint32_t order[2 * LEASES];
			for (uint32_t i = 0; i < 2 * LEASES; i++) {
				canvas_random_state = 1000003u * (uint32_t)(pair * 2 * LEASES + (int)i + 1);
				batches[i] = canvas_test_batch(&p, (uint64_t)pair * 2 + i / LEASES, i % 16, i / 16 % 4,
							       1, wide_range_value);
				order[i] = i;
			}
			canvas_random_state = (uint64_t)(77 + order_seed * 1000 + pair);
			if (order_seed)
				shuffle(order, 2 * LEASES);
			for (uint32_t i = 0; i < 2 * LEASES; i++) {
				struct error e;
				if (canvas_add(c, &batches[order[i]], &e) != 0)
					fail_msg("%s", e.text);
			}
			for (uint32_t i = 0; i < 2 * LEASES; i++)
				batch_fini(&batches[i]);
			assert_int_equal(canvas_complete_rounds(c), (uint64_t)pair * 2 + 2);
		}
		struct canvas_image img;
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		if (order_seed == 0) {
			first = img;
		} else {
			assert_memory_equal(img.rgb, first.rgb, 5 * 4 * 3 * sizeof(float));
			assert_memory_equal(img.error, first.error, 5 * 4 * 3 * sizeof(float));
			assert_true(img.rel_mse == first.rel_mse && img.rel_mse_upper == first.rel_mse_upper);
			canvas_image_fini(&img);
		}
		canvas_free(c);
	}
	canvas_image_fini(&first);
}

static float huge_value(void)
{
	return 1e12f;
}

static void a_sum_beyond_the_grid_adds_nothing(void **unused)
{
	(void)unused;
	struct plan p = canvas_test_plan(PLAN_SAMPLES, 100, 70, 1, 1);
	struct canvas *c;
	struct canvas_image before, after;
	assert_int_equal(canvas_new(&c, &p, -20, NULL, NULL), 0); /* 1e12 x 2^20 = 1.05e18 = 2^59.9 */
	struct batch b = canvas_test_batch(&p, 0, 0, 0, 4, canvas_test_one);
	assert_int_equal(canvas_add(c, &b, NULL), 0);
	batch_fini(&b);
	uint64_t rounds = 1;
	int rc = 0;
	assert_int_equal(canvas_image_init(c, false, &before, NULL), 0);
	while (rc == 0 && rounds < 20) {
		canvas_image_fini(&before);
		assert_int_equal(canvas_image_init(c, false, &before, NULL), 0);
		b = canvas_test_batch(&p, rounds, 0, 0, 4, canvas_test_one);
		b.tiles[2].xyz[100] = huge_value();
		rc = canvas_add(c, &b, NULL);
		rounds += rc == 0;
		batch_fini(&b);
	}
	assert_int_equal(rc, -ERANGE);
	assert_int_equal(rounds, 5); /* four of them fit below 2^62 */
	assert_int_equal(canvas_complete_rounds(c), rounds);
	assert_int_equal(canvas_image_init(c, false, &after, NULL), 0);
	assert_memory_equal(before.rgb, after.rgb, 100 * 70 * 3 * sizeof(float));
	/* The same lease with values that fit is still accepted, and then the bits are those of a run without the bad
	 * batch. */
	b = canvas_test_batch(&p, rounds, 0, 0, 4, canvas_test_one);
	assert_int_equal(canvas_add(c, &b, NULL), 0);
	batch_fini(&b);
	b = canvas_test_batch(&p, rounds + 1, 0, 0, 4, canvas_test_one);
	b.tiles[3].xyz[7] = 3e38f;
	assert_int_equal(canvas_add(c, &b, NULL), -ERANGE);
	batch_fini(&b);
	b = canvas_test_batch(&p, rounds + 1, 0, 0, 4, canvas_test_one);
	assert_int_equal(canvas_add(c, &b, NULL), 0);
	batch_fini(&b);
	canvas_image_fini(&after);
	assert_int_equal(canvas_image_init(c, false, &after, NULL), 0);
	canvas_free(c);
	assert_int_equal(canvas_new(&c, &p, -20, NULL, NULL), 0);
	for (uint64_t r = 0; r < rounds + 2; r++) {
		b = canvas_test_batch(&p, r, 0, 0, 4, canvas_test_one);
		if (r > 0 && r < rounds)
			b.tiles[2].xyz[100] = huge_value();
		assert_int_equal(canvas_add(c, &b, NULL), 0);
		batch_fini(&b);
	}
	canvas_image_fini(&before);
	assert_int_equal(canvas_image_init(c, false, &before, NULL), 0);
	assert_memory_equal(before.rgb, after.rgb, 100 * 70 * 3 * sizeof(float));
	canvas_image_fini(&before);
	canvas_image_fini(&after);
	canvas_free(c);
}

static void only_complete_rounds_are_published(void **unused)
{
	(void)unused;
	struct plan p = canvas_test_plan(PLAN_SAMPLES, 8, 8, 2, 2);
	struct canvas *c;
	struct canvas_image img;
	assert_int_equal(canvas_new(&c, &p, -20, NULL, NULL), 0);
	/* All of round 1 and all but one lease of round 0. */
	for (uint32_t i = 0; i < 7; i++) {
		struct batch b = canvas_test_batch(&p, 1 - (i >= 4), i % 2, i / 2 % 2, 1, canvas_test_one);
		b.counters[COUNT_NAN] = 1;
		assert_int_equal(canvas_add(c, &b, NULL), 0);
		assert_int_equal(canvas_add(c, &b, NULL), -EEXIST);
		assert_true(canvas_has_lease(c, &b.key));
		batch_fini(&b);
	}
	assert_int_equal(canvas_complete_rounds(c), 0);
	assert_int_equal(canvas_merged_leases(c), 7);
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	assert_true(img.is_black && img.counts.counters[COUNT_NAN] == 0 && isnan(img.rel_mse));
	canvas_image_fini(&img);
	assert_int_equal(canvas_image_init(c, true, &img, NULL), 0);
	assert_false(img.is_black);
	canvas_image_fini(&img);
	struct batch b = canvas_test_batch(&p, 2, 0, 0, 1, canvas_test_one);
	assert_int_equal(canvas_add(c, &b, NULL), -EAGAIN);
	batch_fini(&b);
	b = canvas_test_batch(&p, 0, 1, 1, 1, canvas_test_one); /* the last batch closes both rounds */
	assert_int_equal(canvas_add(c, &b, NULL), 0);
	assert_true(canvas_has_lease(c, &b.key));
	b.key.epoch = 2;
	assert_false(canvas_has_lease(c, &b.key));
	batch_fini(&b);
	assert_int_equal(canvas_complete_rounds(c), 2);
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	assert_int_equal(img.counts.counters[COUNT_NAN], 7);
	/* Sums of 1 from two parts, 4 samples a pixel and round: XYZ = 0.5, whose Y is 0.5. */
	double y = 0.2126729 * (double)img.rgb[0] + 0.7151522 * (double)img.rgb[1] + 0.0721750 * (double)img.rgb[2];
	assert_true(fabs(y - 0.5) < 1e-6);
	canvas_image_fini(&img);
	canvas_free(c);
}

/* Chains: a group's image is scaled by the group's b and the published image by the pooled b; independent samples count
 * from the bootstrap and from complete rounds only. */
static void chains_are_scaled_by_b(void **unused)
{
	(void)unused;
	struct plan p = canvas_test_plan(PLAN_CHAINS, 4, 4, 2, 1);
	struct canvas *c;
	struct canvas_image img;
	assert_int_equal(canvas_new(&c, &p, canvas_grid_exponent(&p, 1, 1), NULL, NULL), 0);
	for (uint32_t g = 0; g < 2; g++) {
		struct batch boot = {
			.key = {1, LEASE_BOOTSTRAP, g, 0, 0}, .independent_sum = g ? 24 : 16, .overlong_sum = 8};
		boot.counters[COUNT_INDEPENDENT] = 8;
		boot.counters[COUNT_SAMPLES] = 8;
		assert_int_equal(canvas_add(c, &boot, NULL), 0);
		assert_int_equal(canvas_add(c, &boot, NULL), -EEXIST);
		struct batch b = canvas_test_batch(&p, 0, g, 0, 1, canvas_test_one);
		b.counters[COUNT_INDEPENDENT] = 8;
		b.independent_sum = g ? 40 : 0; /* no light: its samples count all the same */
		b.counters[COUNT_LONGEST_STUCK] = g ? 5 : 7;
		assert_int_equal(canvas_add(c, &b, NULL), 0);
		batch_fini(&b);
	}
	/* A batch of an open round, which must not count. */
	struct batch early = canvas_test_batch(&p, 1, 0, 0, 1, canvas_test_one);
	early.independent_sum = 1e9;
	assert_int_equal(canvas_add(c, &early, NULL), 0);
	batch_fini(&early);
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	/* b: group 0 16/16, group 1 64/16, pooled 80/32; standard error |4 - 1| / 2. 8 mutations a group. */
	assert_true(img.b == 2.5 && fabs(img.b_error - 1.5) < 1e-12);
	assert_int_equal(img.samples, 16);
	assert_int_equal(img.counts.counters[COUNT_LONGEST_STUCK], 7);
	assert_true(fabs(img.overlong_share - 16.0 / 56) < 1e-12);
	double y = 0.2126729 * (double)img.rgb[0] + 0.7151522 * (double)img.rgb[1] + 0.0721750 * (double)img.rgb[2];
	assert_true(fabs(y - 2.5 * 2 / 16) < 1e-6);
	/* Group images are 1/8 and 4/8 in each of X, Y, Z: error 3/16 of the white of XYZ (1,1,1). */
	double white = 3.2404541621141054 - 1.5371385127977166 - 0.4985314095560162;
	assert_true(fabs((double)img.error[0] / (3.0 / 16 * white) - 1) < 1e-6);
	canvas_image_fini(&img);
	canvas_free(c);
}

static void grid_exponent_fits_the_values(void **unused)
{
	(void)unused;
	struct plan p = canvas_test_plan(PLAN_SAMPLES, 10, 10, 16, 4);
	/* b = 100 over 100 pixels, 4 samples: sums of 4, in units of 2^-28 of that (or half) */
	assert_int_equal(canvas_grid_exponent(&p, 100, 0), 3 - 28);
	assert_int_equal(canvas_grid_exponent(&p, 0, 1), 1 - 40);
	assert_int_equal(canvas_grid_exponent(&p, 0, 0), -32);
	assert_int_equal(canvas_grid_exponent(&p, NAN, INFINITY), -32);
	assert_int_equal(canvas_grid_exponent(&p, 1e-300, 0), -900);
	p = canvas_test_plan(PLAN_CHAINS, 10, 10, 16, 4);
	assert_int_equal(canvas_grid_exponent(&p, 1e9, 1e9), -32);
}

static float random_float(void)
{
	return (float)canvas_random_uniform();
}

/* Values are rounded to the nearest, not towards zero, also beside a value that fills a double's mantissa. */
static void values_are_rounded_to_the_grid(void **unused)
{
	(void)unused;
	for (int large = 0; large < 2; large++) {
		struct plan p = canvas_test_plan(PLAN_SAMPLES, 2, 1, 1, 1);
		struct canvas *c;
		double block[3];
		assert_int_equal(canvas_new(&c, &p, 0, NULL, NULL), 0);
		struct batch b = canvas_test_batch(&p, 0, 0, 0, 1, canvas_test_one);
		b.tiles[0].xyz[0] = large ? 0x1p52f : 1;
		b.tiles[0].xyz[3] = 0.75f;
		b.tiles[0].xyz[4] = 1.75f;
		b.tiles[0].xyz[5] = 2.5f;
		assert_int_equal(canvas_add(c, &b, NULL), 0);
		batch_fini(&b);
		canvas_group_blocks(c, 2, 1, block);
		assert_true(block[1] == (1.0 + 2 + 2) / (double)p.epoch);
		canvas_free(c);
	}
}

/* The mean over groups of the blocks is the image's if the groups have equally many samples; each group is scaled by
 * its own b. */
static void blocks_of_groups_average_to_the_image(void **unused)
{
	(void)unused;
	/* X+Y+Z of Rec. 709's red, green, blue. */
	static const double weight[3] = {0.644463186, 1.191920259, 1.202916555};
	for (int kind = PLAN_SAMPLES; kind <= PLAN_CHAINS; kind++) {
		struct plan p = canvas_test_plan((enum plan_kind)kind, 100, 70, 4, 1);
		struct canvas *c;
		struct canvas_image img;
		double block[4][7], sum[7] = {0}, b_sum = 0;
		canvas_random_state = 77;
		assert_int_equal(canvas_new(&c, &p, -32, NULL, NULL), 0);
		for (uint64_t round = 0; round < 2; round++)
			for (uint32_t g = 0; g < 4; g++) {
				struct batch b = canvas_test_batch(&p, round, g, 0, 4, random_float);
				b.independent_sum = (g + 1) * (double)p.epoch;
				assert_int_equal(canvas_add(c, &b, NULL), 0);
				batch_fini(&b);
			}
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		canvas_group_blocks(c, 3, 2, block[0]);
		for (uint32_t g = 0; g < 4; g++) {
			/* Replaces the group's own b by the pooled one. */
			double group_scale = kind == PLAN_CHAINS ? (g + 1) / img.b : 1;
			b_sum += group_scale / 4;
			for (int k = 0; k < 7; k++)
				sum[k] += block[g][k] / group_scale / 4;
		}
		assert_true(fabs(b_sum - 1) < 1e-12);
		for (uint32_t k = 0; k < 7; k++) {
			uint32_t x0 = k < 6 ? 100 * (k % 3) / 3 : 0, x1 = k < 6 ? 100 * (k % 3 + 1) / 3 : 100;
			uint32_t y0 = k < 6 ? 35 * (k / 3) : 0, y1 = k < 6 ? y0 + 35 : 70;
			double mean = 0;
			for (uint32_t y = y0; y < y1; y++)
				for (uint32_t x = x0; x < x1; x++)
					for (uint32_t i = 0; i < 3; i++)
						mean += weight[i] * (double)img.rgb[(y * 100 + x) * 3 + i] /
							((x1 - x0) * (y1 - y0));
			if (!(fabs(sum[k] / mean - 1) < 1e-6))
				fail_msg("kind %d, block %u: %.9g is not %.9g", kind, k, sum[k], mean);
		}
		canvas_image_fini(&img);
		canvas_free(c);
	}
}

/* The groups differ by a few percent, so that errors of pixels are not averaged with those of their neighbours. */
static void failing_allocations_leak_nothing(void **unused)
{
	(void)unused;
	struct plan p = canvas_test_plan(PLAN_SAMPLES, 8, 8, 2, 2);
	int rc = -1;
	for (long n = 0; rc != 0; n++) {
		struct canvas *c;
		struct canvas_image img;
		mem_fail_after(n);
		rc = canvas_new(&c, &p, -20, NULL, NULL);
		if (rc == 0) {
			rc = canvas_image_init(c, false, &img, NULL);
			if (rc == 0)
				canvas_image_fini(&img);
		}
		mem_fail_after(-1);
		canvas_free(c);
	}
}

static void missing_folder_is_an_error(void **unused)
{
	(void)unused;
	struct plan p = canvas_test_plan(PLAN_SAMPLES, 8, 8, 2, 2);
	struct canvas *c;
	struct error e;
	assert_int_equal(canvas_new(&c, &p, -20, "/nonexistent/folder", &e), -ENOENT);
	assert_null(c);
	assert_non_null(strstr(e.text, "/nonexistent/folder"));
}

/* A pixel never holds more than the mutations of a lease of chains, and a lease of samples never fills more than an
 * eighth of the range. */
static void a_pixel_of_one_lease_is_bounded(void **unused)
{
	(void)unused;
	const enum plan_kind kinds[] = {PLAN_CHAINS, PLAN_SAMPLES};
	for (int i = 0; i < 2; i++) {
		bool chains = kinds[i] == PLAN_CHAINS;
		struct plan p = {.kind = kinds[i],
				 .integrator = "hslt",
				 .width = 64,
				 .height = 64,
				 .crop_width = 64,
				 .crop_height = 64,
				 .groups = 1,
				 .parts = 1,
				 .chains = chains ? 1 : 0,
				 .bootstrap = 8,
				 .epoch = 10,
				 .rounds = 1000,
				 .max_depth = 8};
		struct canvas *c;
		struct error e;
		float *xyz = mem_alloc(64 * 64 * TILE_CHANNELS, sizeof *xyz);
		struct tile tile = {0, 0, 64, 64, xyz};
		struct batch b = {.key = {1, LEASE_RENDER, 0, 0, 0},
				  .tile_count = 1,
				  .tiles = &tile,
				  .counters = {[COUNT_SAMPLES] = 10}};
		assert_int_equal(canvas_new(&c, &p, -30, NULL, NULL), 0);
		/* The quantum is 2^-30, and sums stay below 2^62 quanta. */
		float limit = chains ? 0x1p14f * 10 : 0x1p29f;
		xyz[77] = limit;
		assert_int_equal(canvas_check_range(c, &b, &e), 0);
		xyz[77] = -limit;
		assert_int_equal(canvas_check_range(c, &b, &e), 0);
		xyz[77] = nextafterf(limit, INFINITY);
		assert_int_equal(canvas_check_range(c, &b, &e), chains ? -EBADMSG : -ERANGE);
		assert_non_null(strstr(e.text, "tile at 0,0"));
		xyz[77] = -3e38f;
		assert_int_equal(canvas_check_range(c, &b, &e), chains ? -EBADMSG : -ERANGE);
		canvas_free(c);
		mem_free(xyz);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bits_do_not_depend_on_the_order_of_batches),
		cmocka_unit_test(a_sum_beyond_the_grid_adds_nothing),
		cmocka_unit_test(a_pixel_of_one_lease_is_bounded),
		cmocka_unit_test(only_complete_rounds_are_published),
		cmocka_unit_test(chains_are_scaled_by_b),
		cmocka_unit_test(grid_exponent_fits_the_values),
		cmocka_unit_test(values_are_rounded_to_the_grid),
		cmocka_unit_test(blocks_of_groups_average_to_the_image),
		cmocka_unit_test(failing_allocations_leak_nothing),
		cmocka_unit_test(missing_folder_is_an_error),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
