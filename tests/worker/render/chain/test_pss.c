/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Primary sample space: small steps are symmetric, states survive saving, and chains obey Metropolis: on targets
 * known in closed form, the histogram of a chain's splats is the target. Level 1e-6 for each test; seeds are the hash
 * of the test's name.
 */
#include "tests/support/dice.h"
#include "tests/support/stats.h"
#include "worker/render/chain/pss.h"
#include "worker/render/chain/chain.h"
#include "worker/render/path/integrator.h"
#include "worker/render/math/fptrap.h"

#include "common/base/mem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define chain_pss (*integrator_find("pssmlt")->chain)

#define LEVEL 1e-6

/* A small step goes from u to u +- s, with s between 1/1024 and 1/64 at a density proportional to 1/s: the same on
 * both sides, wrapped around. */
static void small_steps_are_symmetric_with_their_density(void **state)
{
	(void)state;
	enum { CELLS = 32 };
	const double from[] = {0, 0x1p-53, 1e-9, 0.001, 0.3, 0.5, 0.999, 1 - 0x1p-53};
	struct dice d = dice_for_test("small step");
	for (size_t k = 0; k < sizeof from / sizeof from[0]; k++) {
		uint64_t counts[2 * CELLS] = {0};
		double expected[2 * CELLS];
		size_t n = dice_scaled_count(100000);
		for (size_t i = 0; i < n; i++) {
			double to = pss_small_step(from[k], dice_uniform(&d));
			assert_true(to >= 0 && to < 1);
			double step = to - from[k];
			step -= rint(step);
			double place = log(fabs(step) * 1024) / log(16);
			assert_true(place > -1e-9 && place < 1 + 1e-9);
			counts[(step < 0 ? CELLS : 0) + (int)fmin(fmax(place, 0) * CELLS, CELLS - 1)]++;
		}
		for (int i = 0; i < 2 * CELLS; i++)
			expected[i] = (double)n / (2 * CELLS);
		assert_true(stats_counts_p(counts, expected, 2 * CELLS) > LEVEL);
	}
	const double ends[] = {0, 0x1p-53, 0.5 - 0x1p-54, 0.5, 1 - 0x1p-53};
	for (int i = 0; i < 25; i++) {
		double to = pss_small_step(ends[i / 5], ends[i % 5]);
		assert_true(to >= 0 && to < 1);
	}
}

/* Steps in both directions: from uniform points, as many go from one cell to another as return. */
static void as_many_steps_go_as_return(void **state)
{
	(void)state;
	enum { CELLS = 64 };
	static uint64_t moves[CELLS][CELLS];
	struct dice d = dice_for_test("both ways");
	size_t n = dice_scaled_count(2000000);
	for (size_t i = 0; i < n; i++) {
		double u = dice_uniform(&d), v = pss_small_step(u, dice_uniform(&d));
		moves[(int)(u * CELLS)][(int)(v * CELLS)]++;
	}
	double chi2 = 0, degrees = 0;
	for (int i = 0; i < CELLS; i++)
		for (int j = 0; j < i; j++) {
			double forward = (double)moves[i][j], reverse = (double)moves[j][i];
			if (forward + reverse < 10)
				continue;
			chi2 += (forward - reverse) * (forward - reverse) / (forward + reverse);
			degrees++;
		}
	assert_true(degrees >= CELLS - 1);
	assert_true(stats_chi2_p(chi2, degrees) > LEVEL);
}

static void fill_point(struct pss_point *p, unsigned camera, unsigned light, struct dice *d)
{
	memset(p, 0, sizeof *p);
	p->block_count[0] = camera;
	p->block_count[1] = light;
	for (int s = 0; s < SAMPLER_SIDES; s++)
		for (unsigned v = 0; v < p->block_count[s]; v++)
			for (int i = 0; i < SAMPLER_BLOCK_SIZE; i++)
				p->u[s][v][i] = dice_uniform(d);
}

static void point_survives_saving(void **state)
{
	(void)state;
	static uint8_t bytes[CHAIN_STATE_MAX];
	static struct pss_point p, q;
	struct dice d = dice_for_test("bytes");
	for (unsigned i = 0; i < 200; i++) {
		unsigned camera = i == 0 ? 0 : i == 1 ? PSS_VERTICES_MAX : dice_below(&d, PSS_VERTICES_MAX + 1);
		fill_point(&p, camera, i == 1 ? PSS_VERTICES_MAX : dice_below(&d, PSS_VERTICES_MAX + 1), &d);
		size_t n = pss_write(&p, bytes, sizeof bytes);
		assert_int_equal(n, 8 + 64 * (p.block_count[0] + p.block_count[1]));
		assert_int_equal(pss_write(&p, bytes, n), n);
		assert_int_equal(pss_write(&p, bytes, n - 1), 0);
		memset(&q, 0, sizeof q);
		assert_int_equal(pss_read(&q, bytes, n), n);
		assert_memory_equal(&p, &q, sizeof p);
		/* Truncated anywhere, the state is refused. */
		uint8_t *cut = malloc(n);
		size_t keep = dice_below(&d, (uint32_t)n);
		memcpy(cut, bytes, keep);
		assert_int_equal(pss_read(&q, cut, keep), 0);
		free(cut);
	}
	const double bad[] = {-0x1p-60, 1, 1.5, -1, NAN, INFINITY, -INFINITY, 1e300};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		fill_point(&p, 3, 2, &d);
		p.u[i % 2][1][i] = bad[i];
		size_t n = pss_write(&p, bytes, sizeof bytes);
		assert_int_equal(pss_read(&q, bytes, n), 0);
	}
	/* Counts beyond the arrays, and counts whose product overflows. */
	const uint32_t counts[] = {PSS_VERTICES_MAX + 1, 1000, 1u << 26, 1u << 31, UINT32_MAX};
	for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++)
		for (int side = 0; side < 2; side++) {
			fill_point(&p, 3, 2, &d);
			pss_write(&p, bytes, sizeof bytes);
			for (int k = 0; k < 4; k++)
				bytes[4 * side + k] = (uint8_t)(counts[i] >> (8 * k));
			assert_int_equal(pss_read(&q, bytes, sizeof bytes), 0);
		}
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		size_t n = dice_below(&d, 400);
		for (size_t k = 0; k < n; k++)
			bytes[k] = k % 4 && k < 8 ? 0 : (uint8_t)dice_below(&d, 256);
		size_t used = pss_read(&q, bytes, n);
		assert_true(used <= n);
		if (!used)
			continue;
		for (int s = 0; s < SAMPLER_SIDES; s++)
			for (unsigned v = 0; v < q.block_count[s]; v++)
				for (int k = 0; k < SAMPLER_BLOCK_SIZE; k++)
					assert_true(q.u[s][v][k] >= 0 && q.u[s][v][k] < 1);
	}
}

/* The state with one vertex of the camera and none of a light: its bytes are the same on every machine, and must
 * never change. */
static void bytes_of_a_state_never_change(void **state)
{
	(void)state;
	static const double u[SAMPLER_BLOCK_SIZE] = {0.5, 0.25, 0x1p-53, 0, 0.75, 0, 0, 1 - 0x1p-53};
	static const uint8_t expected[8 + 64] = {
		1, 0, 0, 0, 0,	  0,	0, 0, 0, 0, 0,	  0,	0,    0,    0xe0, 0x3f, 0,    0,
		0, 0, 0, 0, 0xd0, 0x3f, 0, 0, 0, 0, 0,	  0,	0xa0, 0x3c, 0,	  0,	0,    0,
		0, 0, 0, 0, 0,	  0,	0, 0, 0, 0, 0xe8, 0x3f, 0,    0,    0,	  0,	0,    0,
		0, 0, 0, 0, 0,	  0,	0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xef, 0x3f};
	static struct pss_point p, q;
	uint8_t bytes[sizeof expected];
	p.block_count[SIDE_CAMERA] = 1;
	memcpy(p.u[SIDE_CAMERA][0], u, sizeof u);
	assert_int_equal(pss_write(&p, bytes, sizeof bytes), sizeof bytes);
	assert_memory_equal(bytes, expected, sizeof expected);
	assert_int_equal(pss_read(&q, expected, sizeof expected), sizeof expected);
	assert_memory_equal(&p, &q, sizeof p);
}

/* Targets on a film of 16 x 16. In the first, the density is a function of two numbers; in the second, the path
 * length is drawn as well, and longer paths use more blocks; the third has two splats per sample, one of them dark,
 * and regions of value 0. */
enum { SIDE = 16 };

static double density_profile(double x, double y)
{
	return 0.2 + pow(x, 3) + 2 * exp(-60 * ((x - 0.25) * (x - 0.25) + (y - 0.7) * (y - 0.7)));
}

static void add_splat(struct path_sample *out, double x, double y, double value)
{
	struct splat *s = &out->splats[out->splat_count++];
	*s = (struct splat){x * SIDE, y * SIDE, {value / 2, value / 3, value / 6}};
	out->intensity += s->xyz[0] + s->xyz[1] + s->xyz[2];
}

static void evaluate_fixed_length(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	(void)c;
	out->splat_count = 0;
	out->intensity = 0;
	out->class_mask = 0;
	const double *u = s->block(s, SIDE_CAMERA, 0);
	add_splat(out, u[0], u[1], density_profile(u[0], u[1]));
}

static void evaluate_lengths(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	(void)c;
	out->splat_count = 0;
	out->intensity = 0;
	out->class_mask = 0;
	const double *u = s->block(s, SIDE_CAMERA, 0);
	double x = u[0], y = u[1], value = density_profile(x, y);
	for (unsigned v = 1; v < 12; v++) {
		u = s->block(s, v % 3 ? SIDE_CAMERA : SIDE_LIGHT, v % 3 ? v : v / 3 - 1);
		if (u[2] < 0.3)
			break;
		/* The factor has the mean 1. */
		value *= 0.5 + u[3];
	}
	add_splat(out, x, y, value);
}

static void evaluate_with_holes(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	(void)c;
	out->splat_count = 0;
	out->intensity = 0;
	out->class_mask = 0;
	const double *u = s->block(s, SIDE_CAMERA, 0);
	double x = u[0], y = u[1], w = u[5];
	if (w < 0.4)
		return;
	add_splat(out, x, y, density_profile(x, y) * (w < 0.7 ? 1 / 0.3 : 0));
	const double *l = s->block(s, SIDE_LIGHT, 0);
	add_splat(out, l[0], l[1], density_profile(l[0], l[1]) / 0.6);
}

/* Runs groups of chains; each group estimates its own b from its large steps, like the groups of a job. The mean of
 * each cell's sum is compared with the exact one by t between 16 groups; power: a cell that is off by at most 12 %,
 * or a mean by 2 %, is found with 95 % probability. */
static void check_target(const char *name,
			 void (*evaluate)(struct path_context *, struct sampler *, struct path_sample *), double times)
{
	enum { GROUPS = 16, CELLS = 4 };
	static double cell[CELLS * CELLS][GROUPS], exact[CELLS * CELLS], total[GROUPS];
	struct chain *c = test_malloc(chain_pss.size);
	static struct path_context context;
	uint64_t counters[BATCH_COUNTERS] = {0};
	context.counters = counters;
	const struct integrator integrator = {.stream = RNG_BOOTSTRAP, .evaluate = evaluate};
	struct plan plan = {.width = SIDE, .height = SIDE, .crop_width = SIDE, .crop_height = SIDE};
	struct scene_settings settings = {.width = SIDE, .height = SIDE, .filter = FILTER_BOX, .filter_radius = 0.5};
	size_t steps = dice_scaled_count(400000);
	for (int k = 0; k < CELLS * CELLS; k++) {
		enum { SUB = 200 };
		exact[k] = 0;
		for (int i = 0; i < SUB * SUB; i++)
			exact[k] += times *
				    density_profile((k % CELLS + (i % SUB + 0.5) / SUB) / CELLS,
						    (k / CELLS + (i / SUB + 0.5) / SUB) / CELLS) /
				    (SUB * SUB) / (CELLS * CELLS);
	}
	for (int g = 0; g < GROUPS; g++) {
		struct film_sums film;
		struct chain_sums sums = {0, 0};
		assert_int_equal(film_sums_init(&film, &plan, &settings, NULL), 0);
		memset(counters, 0, sizeof counters);
		*c = (struct chain){.integrator = &integrator,
				    .context = &context,
				    .film = &film,
				    .seed = stats_seed(name),
				    .id = (uint64_t)g};
		/* Any start is good enough: chains of this length forget it. */
		assert_true(chain_pss.start(c, UINT64_MAX));
		for (size_t i = 0; i < steps; i++)
			chain_pss.step(c, &sums);
		chain_pss.flush(c);
		assert_int_equal(counters[COUNT_SAMPLES], steps);
		assert_true(counters[COUNT_ACCEPTED] > steps / 4 && counters[COUNT_ACCEPTED] < steps);
		double b = sums.sum / (double)counters[COUNT_INDEPENDENT], sum = 0;
		for (int k = 0; k < CELLS * CELLS; k++)
			cell[k][g] = 0;
		for (int i = 0; i < SIDE * SIDE; i++) {
			double v = (film.xyz[3 * i] + film.xyz[3 * i + 1] + film.xyz[3 * i + 2]) * b / (double)steps;
			cell[(i / SIDE) / (SIDE / CELLS) * CELLS + (i % SIDE) / (SIDE / CELLS)][g] += v;
			sum += v;
		}
		total[g] = sum;
		film_sums_fini(&film);
	}
	double worst = 0, whole = 0;
	for (int k = 0; k < CELLS * CELLS; k++) {
		struct stats_mean m = stats_mean_test(cell[k], GROUPS, exact[k]);
		worst = fmax(worst, m.error / exact[k]);
		whole += exact[k];
		if (m.p < LEVEL)
			fail_msg("%s: cell %d is %.6g +- %.1g, not %.6g (p = %g)", name, k, m.mean, m.error, exact[k],
				 m.p);
	}
	struct stats_mean m = stats_mean_test(total, GROUPS, whole);
	print_message("%s: mean %.5f +- %.5f of %.5f; worst cell +- %.2f %%\n", name, m.mean, m.error, whole,
		      100 * worst);
	assert_true(m.p > LEVEL);
	/* t at level 1e-6 with 15 degrees of freedom is 7.7, and 9.4 with the margin for a power of 95 %. */
	if (steps >= 400000)
		assert_true(9.4 * worst < 0.12 && 9.4 * m.error / whole < 0.02);
	test_free(c);
}

static void chain_histograms_follow_closed_form_targets(void **state)
{
	(void)state;
	check_target("plain target", evaluate_fixed_length, 1);
	check_target("target of many lengths", evaluate_lengths, 1);
	check_target("target with holes", evaluate_with_holes, 2);
}

/* Intensities at the limits of double: most points have one of two magnitudes, so that a chain stays at each for a
 * while. */
static double magnitudes[2];

static void evaluate_extremes(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	(void)c;
	out->splat_count = 0;
	out->intensity = 0;
	out->class_mask = 1;
	const double *u = s->block(s, SIDE_CAMERA, 0);
	add_splat(out, u[0], u[1], 6 * magnitudes[u[5] < 0.5]);
	add_splat(out, u[0], u[1], 0);
	out->class_intensity[0] = out->intensity;
}

static void check_finite(const struct film_sums *film, double weight)
{
	double sum = 0;
	float first, second;
	struct chain_moments m = film->moments;
	for (int i = 0; i < SIDE * SIDE * 3; i++) {
		assert_true(isfinite(film->xyz[i]));
		sum += film->xyz[i];
	}
	double classes[PATH_CLASSES];
	chain_moments_end_lease(&m, &second, classes);
	chain_moments_end_sequence(&m, &first);
	assert_true(fabs(sum / weight - 1) < 1e-9);
	assert_true(fabs((double)first / weight - 1) < 1e-6 && fabs((double)second / weight - 1) < 1e-6);
	assert_true(fabs(classes[0] / weight - 1) < 1e-9);
}

/* No intensity makes a film, a moment or a sum infinite. Each mutation adds a weight of 1 to the film, whatever the
 * intensity. */
static void extreme_intensities_keep_sums_finite(void **state)
{
	(void)state;
	const double pairs[][2] = {{0x1p-1074, 0x1p-1074}, {0x1p-1074, 1e-310}, {0x1p-1074, 0},
				   {1e-300, 0x1p-1070},	   {0x1p-1074, 1e30},	{1e-310, 3e38}};
	struct chain *c = test_malloc(chain_pss.size);
	static struct path_context context;
	uint64_t counters[BATCH_COUNTERS];
	context.counters = counters;
	const struct integrator integrator = {.stream = RNG_BOOTSTRAP, .evaluate = evaluate_extremes};
	struct plan plan = {
		.kind = PLAN_CHAINS, .width = SIDE, .height = SIDE, .crop_width = SIDE, .crop_height = SIDE};
	struct scene_settings settings = {.width = SIDE, .height = SIDE, .filter = FILTER_BOX, .filter_radius = 0.5};
	enum { STEPS = 2000 };
	for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
		struct film_sums film;
		struct chain_sums sums = {0, 0};
		uint64_t blind = 0;
		memcpy(magnitudes, pairs[k], sizeof magnitudes);
		memset(counters, 0, sizeof counters);
		assert_int_equal(film_sums_init(&film, &plan, &settings, NULL), 0);
		*c = (struct chain){.integrator = &integrator, .context = &context, .film = &film, .seed = 3, .id = 1};
		assert_true(chain_pss.start(c, UINT64_MAX));
		for (int i = 0; i < STEPS; i++) {
			chain_pss.step(c, &sums);
			blind += counters[COUNT_ACCEPTED] == 0;
		}
		chain_pss.flush(c);
		assert_true(isfinite(sums.sum) && isfinite(sums.square_sum) && sums.sum > 0);
		check_finite(&film, (double)(STEPS - blind));
		film_sums_fini(&film);
	}
	test_free(c);
}

/* A chain that is saved and resumed between epochs continues with the same bits. */
static void resumed_chain_continues_with_the_same_bits(void **state)
{
	(void)state;
	struct chain *whole = test_malloc(chain_pss.size), *parts = test_malloc(chain_pss.size);
	static struct path_context context;
	static uint64_t counters[BATCH_COUNTERS] = {0};
	context.counters = counters;
	const struct integrator integrator = {.stream = RNG_BOOTSTRAP, .evaluate = evaluate_lengths};
	struct plan plan = {.width = SIDE, .height = SIDE, .crop_width = SIDE, .crop_height = SIDE};
	struct scene_settings settings = {.width = SIDE, .height = SIDE, .filter = FILTER_TENT, .filter_radius = 1};
	for (uint64_t start = 0; start < 4; start++) {
		struct film_sums a, b;
		struct chain_sums sa = {0, 0}, sb = {0, 0};
		assert_int_equal(film_sums_init(&a, &plan, &settings, NULL), 0);
		assert_int_equal(film_sums_init(&b, &plan, &settings, NULL), 0);
		*whole =
			(struct chain){.integrator = &integrator, .context = &context, .film = &a, .seed = 5, .id = 11};
		*parts =
			(struct chain){.integrator = &integrator, .context = &context, .film = &b, .seed = 5, .id = 11};
		uint64_t index = start ? start : UINT64_MAX;
		assert_true(chain_pss.start(whole, index) && chain_pss.start(parts, index));
		for (int epoch = 0; epoch < 20; epoch++) {
			struct chain_state s, t;
			for (int i = 0; i < 37; i++) {
				chain_pss.step(whole, &sa);
				chain_pss.step(parts, &sb);
			}
			chain_pss.flush(whole);
			chain_pss.flush(parts);
			assert_int_equal(chain_pss.save(parts, &s), 0);
			memset(parts + 1, 0xa5, chain_pss.size - sizeof *parts);
			parts->rejected_in_a_row = 99;
			parts->step = whole->step + 1; /* of another epoch */
			assert_false(chain_pss.resume(parts, &s));
			parts->step = whole->step;
			assert_true(chain_pss.resume(parts, &s));
			assert_int_equal(chain_pss.save(parts, &t), 0);
			assert_int_equal(s.size, t.size);
			assert_memory_equal(s.bytes, t.bytes, s.size);
			assert_true(s.size <= CHAIN_STATE_MAX);
			/* A truncated state, or that of another chain, is refused. */
			struct chain_state piece = {s.bytes, s.size - 1};
			assert_false(chain_pss.resume(parts, &piece));
			piece.size = 10;
			assert_false(chain_pss.resume(parts, &piece));
			parts->id++;
			assert_false(chain_pss.resume(parts, &s));
			parts->id--;
			if (s.size > CHAIN_STATE_HEADER_BYTES + 8) { /* a signalling NaN: refused without a trap */
				const uint64_t nan = UINT64_C(0x7ff4000000000000);
				struct chain_state bad = {mem_alloc(s.size, 1), s.size};
				memcpy(bad.bytes, s.bytes, s.size);
				memcpy(bad.bytes + CHAIN_STATE_HEADER_BYTES + 8, &nan, sizeof nan);
				bool watched = fptrap_watch();
				assert_false(chain_pss.resume(parts, &bad));
				fptrap_unwatch(watched);
				mem_free(bad.bytes);
			}
			assert_true(chain_pss.resume(parts, &s));
			mem_free(s.bytes);
			mem_free(t.bytes);
		}
		assert_memory_equal(a.xyz, b.xyz, (size_t)SIDE * SIDE * 3 * sizeof *a.xyz);
		assert_memory_equal(&sa, &sb, sizeof sa);
		assert_int_equal(whole->step, parts->step);
		assert_int_equal(whole->rejected_in_a_row, parts->rejected_in_a_row);
		film_sums_fini(&a);
		film_sums_fini(&b);
	}
	test_free(whole);
	test_free(parts);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(small_steps_are_symmetric_with_their_density),
		cmocka_unit_test(as_many_steps_go_as_return),
		cmocka_unit_test(point_survives_saving),
		cmocka_unit_test(bytes_of_a_state_never_change),
		cmocka_unit_test(chain_histograms_follow_closed_form_targets),
		cmocka_unit_test(resumed_chain_continues_with_the_same_bits),
		cmocka_unit_test(extreme_intensities_keep_sums_finite),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
