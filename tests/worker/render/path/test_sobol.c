/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Low-discrepancy samples: the generator matrices are those of the named polynomials, every elementary interval holds
 * its share, each number alone is uniform, the halves of a block, pixels and replicates are independent, and means
 * equal those of independent samples with less variance. Each test has level 1e-6; its seed is the hash of its name.
 */
#include "tests/support/stats.h"
#include "worker/render/path/sobol.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define LEVEL 1e-6

static void draw_block(uint64_t seed, uint64_t index, uint64_t replicate, uint64_t sample, enum sampler_side side,
		       unsigned vertex, double out[SAMPLER_BLOCK_SIZE])
{
	struct sampler_sobol s;
	sampler_sobol_init(&s, seed, RNG_TEST, index, replicate, sample);
	const double *u = s.base.block(&s.base, side, vertex);
	memcpy(out, u, SAMPLER_BLOCK_SIZE * sizeof *out);
	assert_ptr_equal(u, s.base.block(&s.base, side, vertex));
	assert_memory_equal(u, out, SAMPLER_BLOCK_SIZE * sizeof *out);
}

/* Counts the points in each box of size 2^-e[0] x .. x 2^-e[3]; each must hold 2^t points. */
static void check_boxes(const double (*u)[4], unsigned m, unsigned t, const unsigned e[4])
{
	static unsigned count[1u << 10];
	memset(count, 0, sizeof count);
	for (unsigned i = 0; i < 1u << m; i++) {
		unsigned box = 0;
		for (int d = 0; d < 4; d++)
			box = box << e[d] | (unsigned)ldexp(u[i][d], (int)e[d]);
		count[box]++;
	}
	for (unsigned b = 0; b < 1u << (m - t); b++)
		assert_int_equal(count[b], 1u << t);
}

/* Checks all elementary intervals of volume 2^(t - m) for the first two, three and four numbers of a half: each holds
 * 2^t of 2^m points, whichever aligned range of samples is taken. */
static void check_net(const double (*u)[4], unsigned m)
{
	const unsigned quality[5] = {0, 0, 0, 1, 3};
	for (unsigned dimensions = 1; dimensions <= 4; dimensions++) {
		unsigned t = quality[dimensions];
		for (unsigned code = 0; code < 1u << 12; code++) {
			unsigned e[4] = {0}, rest = code;
			for (unsigned d = 1; d < dimensions; d++, rest /= 16)
				e[d] = rest % 16;
			if (rest != 0 || e[1] + e[2] + e[3] > m - t)
				continue;
			e[0] = m - t - e[1] - e[2] - e[3];
			check_boxes(u, m, t, e);
		}
	}
}

static void elementary_intervals_hold_their_share(void **state)
{
	(void)state;
	enum { M = 7 };
	uint64_t seed = stats_seed("test_elementary_intervals");
	const uint64_t first[] = {
		0, 1 << M, 5 << M, UINT64_C(1) << 31, (UINT64_C(1) << 32) - (1 << M), UINT64_C(3) << 32};
	for (uint64_t n = 0; n < 12; n++)
		for (int half = 0; half < 2; half++) {
			double u[1 << M][4], block[SAMPLER_BLOCK_SIZE];
			for (unsigned i = 0; i < 1 << M; i++) {
				draw_block(seed, n, n % 3, first[n % 6] + i, n % 2 ? SIDE_LIGHT : SIDE_CAMERA,
					   (unsigned)n % 5, block);
				memcpy(u[i], block + 4 * half, sizeof u[i]);
			}
			check_net((const double(*)[4])u, M);
		}
}

/* bdpt8 traces a light sub-path where this number is below 1/8: in exactly one of any eight samples that begin at a
 * multiple of 8. */
static void one_of_eight_samples_has_a_light_subpath(void **state)
{
	(void)state;
	uint64_t seed = stats_seed("test_one_of_eight");
	for (uint64_t n = 0; n < 64; n++)
		for (uint64_t first = 0; first < 128; first += 8) {
			unsigned count = 0;
			for (uint64_t i = 0; i < 8; i++) {
				double u[SAMPLER_BLOCK_SIZE];
				draw_block(seed, n, n % 3, first + i, SIDE_CAMERA, 0, u);
				count += u[DIM_LIGHT_SUBPATH] * 8 < 1;
			}
			assert_int_equal(count, 1);
		}
}

/* Points without scrambling, by the recurrence of Bratley and Fox 1988 from the polynomials x + 1, x^2 + x + 1 and
 * x^3 + x + 1. A scramble preserves the number of leading bits that two points share, in every dimension. */
static void compute_direction_numbers(unsigned degree, unsigned inner, const uint32_t *initial, uint32_t v[32])
{
	uint32_t m[32];
	for (unsigned i = 0; i < 32; i++) {
		m[i] = i < degree ? initial[i] : m[i - degree] ^ m[i - degree] << degree;
		for (unsigned k = 1; i >= degree && k < degree; k++)
			m[i] ^= (inner >> (degree - 1 - k) & 1) * (m[i - k] << k);
		v[i] = m[i] << (31 - i);
	}
}

static unsigned shared_bits(uint32_t a, uint32_t b)
{
	return a == b ? 32 : (unsigned)__builtin_clz(a ^ b);
}

static uint32_t unscrambled(const uint32_t v[32], uint32_t i)
{
	uint32_t x = 0;
	for (unsigned b = 0; b < 32; b++)
		x ^= (i >> b & 1) * v[b];
	return x;
}

/* A prefix of 2^11 samples is a shuffled, aligned range of Sobol' points, and the leading bits shared by two of these
 * points depend only on the exclusive or of their indices. So the multiset, over all pairs, of the bits shared in
 * dimension 0 and in another dimension is that of the plain points. */
static void scrambling_keeps_the_named_polynomials(void **state)
{
	(void)state;
	enum { N = 1 << 11 };
	const uint32_t one[] = {1}, two[] = {1, 3}, three[] = {1, 3, 1};
	uint32_t v[4][32];
	for (unsigned i = 0; i < 32; i++)
		v[0][i] = UINT32_C(1) << (31 - i);
	compute_direction_numbers(1, 0, one, v[1]);
	compute_direction_numbers(2, 1, two, v[2]);
	compute_direction_numbers(3, 1, three, v[3]);
	uint64_t seed = stats_seed("test_directions");
	static uint64_t seen[4][13][34], expected[4][13][34];
	memset(seen, 0, sizeof seen);
	memset(expected, 0, sizeof expected);
	static uint32_t u[N][4];
	for (uint32_t i = 0; i < N; i++) {
		double block[SAMPLER_BLOCK_SIZE];
		draw_block(seed, 1, 2, i, SIDE_CAMERA, 0, block);
		for (int d = 0; d < 4; d++)
			u[i][d] = (uint32_t)ldexp(block[d], 32);
	}
	for (uint32_t i = 0; i < N; i++)
		for (uint32_t j = 0; j < i; j++) {
			unsigned shared = shared_bits(u[i][0], u[j][0]),
				 there = shared_bits(unscrambled(v[0], i), unscrambled(v[0], j));
			assert_true(shared < 13 && there < 13);
			for (int d = 1; d < 4; d++) {
				seen[d][shared][shared_bits(u[i][d], u[j][d])]++;
				expected[d][there][shared_bits(unscrambled(v[d], i), unscrambled(v[d], j))]++;
			}
		}
	assert_memory_equal(seen, expected, sizeof seen);
}

enum { CELLS = 16, TRIALS = 1 << 15 };

static void check_uniform(const uint64_t *count, int cells, uint64_t total, const char *what)
{
	double expected[CELLS * CELLS];
	for (int i = 0; i < cells; i++)
		expected[i] = (double)total / cells;
	double p = stats_counts_p(count, expected, (size_t)cells);
	if (!(p > LEVEL))
		fail_msg("%s: p = %g", what, p);
}

static int cell_of(double u)
{
	return (int)(u * CELLS);
}

/* One sample of each of many sequences: each number alone is uniform, and so are its bits below the 2^-32 that
 * stratify. */
static void each_number_alone_is_uniform(void **state)
{
	(void)state;
	uint64_t seed = stats_seed("test_marginals");
	static uint64_t coarse[SAMPLER_BLOCK_SIZE][CELLS], fine[SAMPLER_BLOCK_SIZE][CELLS],
		low[SAMPLER_BLOCK_SIZE][CELLS];
	for (uint64_t n = 0; n < TRIALS; n++) {
		double u[SAMPLER_BLOCK_SIZE];
		draw_block(seed, n / 16, n % 16, 5, SIDE_LIGHT, 3, u);
		for (int d = 0; d < SAMPLER_BLOCK_SIZE; d++) {
			assert_true(u[d] >= 0 && u[d] < 1);
			coarse[d][cell_of(u[d])]++;
			fine[d][cell_of(ldexp(u[d], 16) - floor(ldexp(u[d], 16)))]++;
			low[d][cell_of(ldexp(u[d], 40) - floor(ldexp(u[d], 40)))]++;
		}
	}
	for (int d = 0; d < SAMPLER_BLOCK_SIZE; d++) {
		check_uniform(coarse[d], CELLS, TRIALS, "first bits");
		check_uniform(fine[d], CELLS, TRIALS, "middle bits");
		check_uniform(low[d], CELLS, TRIALS, "last bits");
	}
}

/* Samples with indices from 2^32 on do not repeat earlier ones. */
static void indices_beyond_32_bits_do_not_repeat_samples(void **state)
{
	(void)state;
	uint64_t seed = stats_seed("long sequences"), same = 0;
	for (uint64_t i = 0; i < 1000; i++) {
		double u[SAMPLER_BLOCK_SIZE], v[SAMPLER_BLOCK_SIZE];
		draw_block(seed, 1, 2, i, SIDE_CAMERA, 1, u);
		draw_block(seed, 1, 2, i + (UINT64_C(1) << 32), SIDE_CAMERA, 1, v);
		for (int d = 0; d < SAMPLER_BLOCK_SIZE; d++)
			same += fabs(u[d] - v[d]) < 0x1p-20;
	}
	assert_true(same < 4);
}

/* The same sample of two sequences, or of two blocks: pairs of numbers fill the square evenly. */
static void check_pairs(const char *what, const uint64_t a[2], const uint64_t b[2], unsigned vertex,
			enum sampler_side side)
{
	uint64_t seed = stats_seed(what);
	static uint64_t count[SAMPLER_BLOCK_SIZE][CELLS * CELLS];
	memset(count, 0, sizeof count);
	for (uint64_t n = 0; n < TRIALS; n++) {
		double u[SAMPLER_BLOCK_SIZE], v[SAMPLER_BLOCK_SIZE];
		draw_block(seed + n, a[0], a[1], 3, SIDE_CAMERA, 1, u);
		draw_block(seed + n, b[0], b[1], 3, side, vertex, v);
		for (int d = 0; d < SAMPLER_BLOCK_SIZE; d++)
			count[d][cell_of(u[d]) * CELLS + cell_of(v[d])]++;
	}
	for (int d = 0; d < SAMPLER_BLOCK_SIZE; d++)
		check_uniform(count[d], CELLS * CELLS, TRIALS, what);
}

static void sequences_and_blocks_are_independent(void **state)
{
	(void)state;
	check_pairs("replicates", (const uint64_t[]){7, 0}, (const uint64_t[]){7, 1}, 1, SIDE_CAMERA);
	check_pairs("pixels", (const uint64_t[]){7, 0}, (const uint64_t[]){8, 0}, 1, SIDE_CAMERA);
	check_pairs("index and replicate exchanged", (const uint64_t[]){1, 0}, (const uint64_t[]){0, 1}, 1,
		    SIDE_CAMERA);
	check_pairs("vertices", (const uint64_t[]){7, 0}, (const uint64_t[]){7, 0}, 2, SIDE_CAMERA);
	check_pairs("sides", (const uint64_t[]){7, 0}, (const uint64_t[]){7, 0}, 1, SIDE_LIGHT);
	uint64_t seed = stats_seed("halves"), count[CELLS * CELLS] = {0};
	for (uint64_t n = 0; n < TRIALS; n++) {
		double u[SAMPLER_BLOCK_SIZE];
		draw_block(seed, n, 0, 3, SIDE_CAMERA, 1, u);
		count[cell_of(u[1]) * CELLS + cell_of(u[5])]++;
	}
	check_uniform(count, CELLS * CELLS, TRIALS, "halves");
}

/* A smooth term, a corner, and a term that joins two halves; the mean is known: 1 + 0.6^2 / 2 + 0. */
static double integrand(const double u[SAMPLER_BLOCK_SIZE])
{
	double smooth = (0.5 + u[0]) * (0.5 + u[1]) * (0.5 + u[2]) * (0.5 + u[5]), corner = u[4] + u[5] < 0.6;
	return smooth + corner + (u[0] - 0.5) * (u[4] - 0.5);
}

/* Means of 64 samples over many replicates. Power: the smallest bias found with 95 % probability must be below 1 %, and
 * a planted bias of 2 % must be found. The variance between replicates is at most a third of that of independent
 * samples. */
static void low_discrepancy_means_are_unbiased(void **state)
{
	(void)state;
	enum { GROUPS = 16, REPLICATES = 4096, SAMPLES = 64 };
	double mean[GROUPS] = {0}, square = 0, single = 0;
	const double exact = 1 + 0.18;
	uint64_t seed = stats_seed("test_means");
	for (uint64_t r = 0; r < REPLICATES; r++) {
		double sum = 0;
		for (uint64_t i = 0; i < SAMPLES; i++) {
			double u[SAMPLER_BLOCK_SIZE];
			draw_block(seed, 3, r, i, SIDE_CAMERA, 2, u);
			double f = integrand(u);
			sum += f / SAMPLES;
			single += (f - exact) * (f - exact) / (REPLICATES * SAMPLES);
		}
		mean[r % GROUPS] += sum / (REPLICATES / GROUPS);
		square += (sum - exact) * (sum - exact) / REPLICATES;
	}
	struct stats_mean m = stats_mean_test(mean, GROUPS, exact);
	double gain = single / SAMPLES / square;
	print_message("mean %.5f +- %.5f of %.5f; variance %.1f times less than of independent samples\n", m.mean,
		      m.error, exact, gain);
	assert_true(m.p > LEVEL);
	assert_true(9.4 * m.error < 0.01 * exact);
	assert_true(stats_mean_test(mean, GROUPS, 1.02 * exact).p < LEVEL);
	assert_true(gain > 3);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(elementary_intervals_hold_their_share),
		cmocka_unit_test(one_of_eight_samples_has_a_light_subpath),
		cmocka_unit_test(scrambling_keeps_the_named_polynomials),
		cmocka_unit_test(each_number_alone_is_uniform),
		cmocka_unit_test(indices_beyond_32_bits_do_not_repeat_samples),
		cmocka_unit_test(sequences_and_blocks_are_independent),
		cmocka_unit_test(low_discrepancy_means_are_unbiased),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
