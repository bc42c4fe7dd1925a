/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What canvas_image_init computes for chains: the potential scale reduction of sequences whose answer is known, the
 * error of a tile, energies of path classes; and that the order of batches changes no bit.
 *
 * Level of the statistical test: 1e-6 per tile. Power: V follows chi-square with 1023 degrees of freedom, so that a
 * scale reduction whose V / W is off by 30 % is found with 95 % probability.
 */
#include "common/estimate/canvas_image.h"

#include "common/base/mem.h"
#include "tests/support/dice.h"
#include "tests/support/failing_memory.h"
#include "tests/support/stats.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define SIGNIFICANCE_LEVEL 1e-6
enum { TILES = 6 };

/* The film has six tiles. */
static struct plan make_plan(uint32_t chains, uint32_t groups, uint32_t parts, uint64_t epoch)
{
	struct plan p = {.integrator = "hslt",
			 .kind = PLAN_CHAINS,
			 .width = 200,
			 .height = 100,
			 .crop_x = 5,
			 .crop_y = 7,
			 .crop_width = 150,
			 .crop_height = 90,
			 .groups = groups,
			 .parts = parts,
			 .chains = chains,
			 .bootstrap = (uint64_t)groups * parts * 8,
			 .epoch = epoch,
			 .rounds = UINT64_MAX,
			 .seconds = 1,
			 .max_depth = 8};
	return p;
}

static struct batch make_batch(const struct plan *p, uint64_t epoch, uint32_t lease)
{
	struct batch b = {.key = {1, LEASE_RENDER, lease / p->parts, lease % p->parts, epoch}};
	b.state_count = p->chains / (p->groups * p->parts);
	b.counters[COUNT_SAMPLES] = b.state_count * p->epoch;
	b.counters[COUNT_INDEPENDENT] = 1;
	b.independent_sum = 2;
	b.independent_square = 4;
	b.moment_count = batch_moment_count(p, LEASE_RENDER);
	b.moments = mem_alloc(b.moment_count, sizeof *b.moments);
	return b;
}

static struct canvas *make_canvas(const struct plan *p)
{
	struct canvas *c;
	assert_int_equal(canvas_new(&c, p, -30, NULL, NULL), 0);
	return c;
}

static void add_batch(struct canvas *c, struct batch *b)
{
	assert_int_equal(canvas_add(c, b, NULL), 0);
	batch_fini(b);
}

/* Simulates where a chain is: it draws a tile, or none, and stays there for a number of mutations. */
static const double tile_probability[TILES] = {0.3, 0.05, 0.1, 0, 0.25, 0.2};

static uint32_t draw_tile(struct dice *d)
{
	double u = dice_uniform(d);
	for (uint32_t t = 0; t < TILES; t++) {
		if (u < tile_probability[t])
			return t;
		u -= tile_probability[t];
	}
	return TILES;
}

static void r_hat_of_simulated_chains_is_right(void **state)
{
	(void)state;
	enum { CHAINS = 1024, ROUNDS = 3, EPOCH = 200, N = ROUNDS * EPOCH };
	static const uint32_t dwell_times[] = {1, 10, 50};
	struct dice d = dice_for_test("known sequences");
	for (size_t k = 0; k < sizeof dwell_times / sizeof *dwell_times; k++) {
		struct plan p = make_plan(CHAINS, 16, 4, EPOCH);
		struct canvas *c = make_canvas(&p);
		struct canvas_image img;
		for (uint64_t round = 0; round < ROUNDS; round++)
			for (uint32_t lease = 0; lease < 64; lease++) {
				struct batch b = make_batch(&p, round, lease);
				for (uint32_t chain = 0; chain < CHAINS / 64; chain++)
					for (uint32_t i = 0; i < EPOCH; i += dwell_times[k]) {
						uint32_t t = draw_tile(&d);
						if (t == TILES)
							continue;
						b.moments[chain * TILES + t] += (float)dwell_times[k];
						b.moments[CHAINS / 64 * TILES + t] += (float)dwell_times[k];
					}
				struct error e = {""};
				b.states = mem_alloc(b.state_count, sizeof *b.states);
				for (uint32_t i = 0; i < b.state_count; i++)
					b.states[i] = (struct chain_state){mem_alloc(1, 1), 1};
				assert_int_equal(batch_check(&b, &p, &e), 0);
				add_batch(c, &b);
			}
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		assert_true(img.tiles_across == 3 && img.tiles_down == 2);
		double draws = N / (double)dwell_times[k], sum = 0;
		for (int t = 0; t < TILES; t++) {
			if (tile_probability[t] == 0) {
				assert_true(isnan(img.r_hat[t]) && isnan(img.tile_error[t]) &&
					    img.tile_energy_share[t] == 0);
				continue;
			}
			double r2 = (double)img.r_hat[t] * (double)img.r_hat[t], v = 1 / draws;
			double w = (1 - v) * N / (N - 1.0), degrees = CHAINS - 1;
			double x = (r2 - (N - 1.0) / N) * w / v * degrees;
			double p_high = stats_chi2_p(x, degrees);
			if (!(p_high > SIGNIFICANCE_LEVEL && p_high < 1 - SIGNIFICANCE_LEVEL))
				fail_msg("staying %u: tile %d has R^2 = %.6f, not %.6f", dwell_times[k], t, r2,
					 (N - 1.0) / N + v / w);
			double error = sqrt((1 - tile_probability[t]) / tile_probability[t] / draws / CHAINS);
			assert_true(fabs((double)img.tile_error[t] / error - 1) < 0.2);
			assert_true(fabs((double)img.tile_energy_share[t] / (tile_probability[t] / 0.9) - 1) <
				    6 * error);
			sum += (double)img.tile_energy_share[t];
		}
		assert_true(fabs(sum - 1) < 1e-6);
		canvas_image_fini(&img);
		canvas_free(c);
	}
}

/* Four chains of four mutations each, 1, 2, 2 and 3 of which are in the tile: V = 1/24, W = 7/24. */
static void r_hat_of_four_chains_matches_that_by_hand(void **state)
{
	(void)state;
	struct plan p = make_plan(4, 2, 1, 4);
	struct canvas *c = make_canvas(&p);
	struct canvas_image img;
	for (uint32_t g = 0; g < 2; g++) {
		struct batch b = make_batch(&p, 0, g);
		b.moments[5] = g ? 2 : 1;
		b.moments[TILES + 5] = g ? 3 : 2;
		b.moments[2 * TILES + 5] = g ? 5 : 3;
		add_batch(c, &b);
	}
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	assert_true(fabs((double)img.r_hat[5] - sqrt(3.0 / 4 + 1.0 / 7)) < 1e-6);
	assert_true(fabs((double)img.tile_error[5] - sqrt(1.0 / 24 / 4) / 0.5) < 1e-6);
	canvas_image_fini(&img);
	canvas_free(c);
}

/* Each chain stays in a tile of its own, or spends half of its time there. */
static void chains_that_stay_in_their_tiles_have_a_large_r_hat(void **state)
{
	(void)state;
	struct plan p = make_plan(32, 4, 2, 1000);
	for (int half = 0; half < 2; half++) {
		struct canvas *c = make_canvas(&p);
		struct canvas_image img;
		for (uint32_t lease = 0; lease < 8; lease++) {
			struct batch b = make_batch(&p, 0, lease);
			for (uint32_t i = 0; i < 4; i++) {
				uint32_t own_tile = (lease * 4 + i) % 2;
				b.moments[i * TILES + own_tile] = half ? 500 : 1000;
				b.moments[4 * TILES + own_tile] += half ? 500 : 1000;
			}
			add_batch(c, &b);
		}
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		for (int t = 0; t < 2; t++)
			assert_true(half ? img.r_hat[t] > 1.2f && img.r_hat[t] < 2 : isinf(img.r_hat[t]));
		assert_true(isnan(img.r_hat[2]));
		canvas_image_fini(&img);
		canvas_free(c);
	}
}

/* Rounding must not look like disagreement: all chains are in one tile all the time, or share their light alike. */
static void rounding_does_not_raise_r_hat(void **state)
{
	(void)state;
	struct plan p = make_plan(32, 4, 2, 1000);
	struct canvas *c = make_canvas(&p);
	struct canvas_image img;
	for (uint32_t lease = 0; lease < 8; lease++) {
		struct batch b = make_batch(&p, 0, lease);
		for (uint32_t i = 0; i < 4; i++) {
			b.moments[i * TILES] = lease % 2 ? nextafterf(1000, 0) : 1000;
			b.moments[i * TILES + 1] = 1000.0f / 3;
		}
		b.moments[4 * TILES] = 4000;
		b.moments[4 * TILES + 1] = 4000.0f / 9;
		add_batch(c, &b);
	}
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	assert_true(img.r_hat[0] == 1 && img.r_hat[1] == 1);
	canvas_image_fini(&img);
	canvas_free(c);
}

static void fill_with_wide_range(struct batch *b, struct dice *d)
{
	for (uint64_t i = 0; i < b->moment_count; i++)
		b->moments[i] = (float)(pow(10, dice_between(d, -9, 2)));
	for (int k = 0; k < PATH_CLASSES; k++)
		b->classes[k] = pow(10, dice_between(d, -30, 2));
}

static void order_of_batches_changes_no_bit(void **state)
{
	(void)state;
	enum { LEASES = 16, ROUNDS = 6, ALL = LEASES * ROUNDS, ORDERS = 4 };
	struct plan p = make_plan(64, 8, 2, 1000);
	struct canvas_image first = {0};
	for (int order = 0; order < ORDERS; order++) {
		struct canvas *c = make_canvas(&p);
		struct dice values = dice_for_test("values"), places = dice_for_test("orders");
		struct batch b[ALL], boot[LEASES];
		for (uint32_t i = 0; i < ALL; i++) {
			b[i] = make_batch(&p, i / LEASES, i % LEASES);
			fill_with_wide_range(&b[i], &values);
		}
		for (uint32_t i = 0; i < LEASES; i++) {
			boot[i] = (struct batch){.key = {1, LEASE_BOOTSTRAP, i / 2, i % 2, 0}, .independent_sum = 7};
			boot[i].counters[COUNT_INDEPENDENT] = 8;
			fill_with_wide_range(&boot[i], &values);
		}
		for (int skip = 0; skip < order * 1000; skip++)
			dice_uniform(&places);
		/* In random order within two rounds that are open at the same time. */
		for (uint32_t i = 0; i < ALL; i++) {
			uint32_t from = i / (2 * LEASES) * 2 * LEASES,
				 j = order ? from + dice_below(&places, 2 * LEASES) : i;
			struct batch swap = b[i];
			b[i] = b[j];
			b[j] = swap;
		}
		for (uint32_t i = 0; i < LEASES; i++)
			add_batch(c, &boot[order % 2 ? LEASES - 1 - i : i]);
		for (uint32_t i = 0; i < ALL; i++)
			add_batch(c, &b[i]);
		struct canvas_image img;
		assert_int_equal(canvas_complete_rounds(c), ROUNDS);
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		if (order) {
			assert_memory_equal(img.r_hat, first.r_hat, TILES * sizeof *img.r_hat);
			assert_memory_equal(img.tile_error, first.tile_error, TILES * sizeof *img.tile_error);
			assert_memory_equal(img.tile_energy_share, first.tile_energy_share,
					    TILES * sizeof *img.tile_energy_share);
			assert_memory_equal(img.classes, first.classes, sizeof img.classes);
			canvas_image_fini(&img);
		} else {
			first = img;
		}
		canvas_free(c);
	}
	canvas_image_fini(&first);
}

/* Values of one class that give known means and a known t. */
static void class_energies_match_those_by_hand(void **state)
{
	(void)state;
	struct plan p = make_plan(8, 4, 1, 100);
	struct canvas *c = make_canvas(&p);
	struct canvas_image img;
	const double boot[4] = {8, 16, 24, 32}, time[4] = {20, 40, 60, 60};
	const unsigned class = path_class(3, PATH_CAUSTIC), lost_class = path_class(5, PATH_REFLECTED_CAUSTIC);
	for (uint32_t g = 0; g < 4; g++) {
		struct batch b = {.key = {1, LEASE_BOOTSTRAP, g, 0, 0}, .independent_sum = 80};
		b.counters[COUNT_INDEPENDENT] = 8;
		b.classes[class] = boot[g];
		b.classes[lost_class] = 4;
		add_batch(c, &b);
		b = make_batch(&p, 0, g);
		b.classes[class] = time[g];
		add_batch(c, &b);
	}
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	/* b of each group is 82 / 9: 80 from the 8 samples of the bootstrap, and 2 from one independent proposal. */
	const double group_b = 82.0 / 9;
	double d[4], b[4], h[4];
	for (int g = 0; g < 4; g++) {
		b[g] = boot[g] / 8;
		h[g] = group_b * time[g] / 200;
		d[g] = h[g] - b[g];
	}
	struct stats_mean mb = stats_mean_test(b, 4, 0), mh = stats_mean_test(h, 4, 0), md = stats_mean_test(d, 4, 0);
	const struct path_class_energy *k = &img.classes[class];
	assert_true(fabs(k->bootstrap - mb.mean) < 1e-12 && fabs(k->bootstrap_error - mb.error) < 1e-12);
	assert_true(fabs(k->chains - mh.mean) < 1e-12 && fabs(k->chains_error - mh.error) < 1e-12);
	assert_true(fabs(k->difference_t - md.mean / md.error) < 1e-9);
	assert_true(img.classes[lost_class].bootstrap == 0.5 && img.classes[lost_class].chains == 0);
	assert_true(img.classes[lost_class].difference_t == -INFINITY);
	assert_true(isnan(img.classes[0].difference_t) && img.classes[0].bootstrap == 0);
	canvas_image_fini(&img);
	canvas_free(c);
}

static void r_hat_is_of_complete_rounds_of_chains_only(void **state)
{
	(void)state;
	struct plan p = make_plan(16, 2, 2, 100);
	struct canvas *c = make_canvas(&p);
	struct canvas_image img;
	for (uint32_t lease = 0; lease < 4; lease++) {
		struct batch b = make_batch(&p, 0, lease);
		b.moments[0] = b.moments[4 * TILES] = 100;
		b.classes[2] = 50;
		add_batch(c, &b);
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		assert_true((img.r_hat != NULL) == (lease == 3));
		assert_true(lease == 3 || img.classes[2].chains == 0);
		canvas_image_fini(&img);
		assert_int_equal(canvas_image_init(c, true, &img, NULL), 0);
		assert_null(img.r_hat);
		assert_true(img.classes[2].chains > 0);
		canvas_image_fini(&img);
	}
	struct batch open = make_batch(&p, 1, 0);
	open.moments[1] = open.moments[4 * TILES + 1] = 100;
	add_batch(c, &open);
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	assert_true(isnan(img.r_hat[1]) && img.tile_energy_share[0] == 1);
	canvas_image_fini(&img);
	canvas_free(c);
	p.kind = PLAN_SAMPLES;
	p.chains = 0;
	c = make_canvas(&p);
	struct batch boot = {.key = {1, LEASE_BOOTSTRAP, 0, 0, 0}, .independent_sum = 80, .classes = {16}};
	boot.counters[COUNT_INDEPENDENT] = 8;
	add_batch(c, &boot);
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	assert_null(img.r_hat);
	assert_true(img.classes[0].bootstrap == 1 && isnan(img.classes[0].difference_t)); /* one of two groups */
	canvas_image_fini(&img);
	canvas_free(c);
}

/* More chains than sequences, one in each lease; and sums beyond the grid. */
static void more_chains_than_sequences_and_sums_beyond_the_grid(void **state)
{
	(void)state;
	struct plan p = make_plan(8192, 4, 2, 1000);
	struct canvas *c = make_canvas(&p);
	struct canvas_image img;
	struct error e;
	for (uint32_t lease = 0; lease < 8; lease++) {
		struct batch b = make_batch(&p, 0, lease);
		assert_int_equal(b.moment_count, 2 * TILES);
		b.moments[0] = b.moments[TILES] = 1024 * (lease % 2 ? 250 : 150);
		add_batch(c, &b);
	}
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	double n = 1024000, w = 0.2 * 0.8 - 0.05 * 0.05, v = 0.05 * 0.05 * 8 / 7;
	assert_true(fabs((double)img.r_hat[0] - sqrt((n - 1) / n + v / w)) < 1e-5);
	canvas_image_fini(&img);
	canvas_free(c);
	p = make_plan(16, 2, 2, UINT64_C(1) << 40);
	c = make_canvas(&p);
	for (uint32_t lease = 0; lease < 4; lease++) {
		struct batch b = make_batch(&p, 0, lease);
		b.moments[0] = b.moments[4 * TILES] = 0x1p40f;
		add_batch(c, &b);
	}
	struct batch b = make_batch(&p, 1, 0);
	assert_int_equal(canvas_add(c, &b, &e), -ERANGE);
	batch_fini(&b);
	canvas_free(c);
	for (long n_allocations = 0, rc = -ENOMEM; rc; n_allocations++) {
		mem_fail_after(n_allocations);
		rc = canvas_new(&c, &p, -30, NULL, &e);
		mem_fail_after(-1);
		assert_true(rc == 0 || rc == -ENOMEM);
	}
	b = make_batch(&p, 0, 0);
	add_batch(c, &b);
	canvas_free(c);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(r_hat_of_simulated_chains_is_right),
		cmocka_unit_test(r_hat_of_four_chains_matches_that_by_hand),
		cmocka_unit_test(chains_that_stay_in_their_tiles_have_a_large_r_hat),
		cmocka_unit_test(rounding_does_not_raise_r_hat),
		cmocka_unit_test(order_of_batches_changes_no_bit),
		cmocka_unit_test(class_energies_match_those_by_hand),
		cmocka_unit_test(r_hat_is_of_complete_rounds_of_chains_only),
		cmocka_unit_test(more_chains_than_sequences_and_sums_beyond_the_grid),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
