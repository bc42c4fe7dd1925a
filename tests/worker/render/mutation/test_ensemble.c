/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The parts of bidirectional proposals, each against an independent computation: a candidate's contribution does not
 * depend on whether its pair of sub-paths was drawn afresh or around the path itself, lengths match their
 * probabilities, the two pairs of a proposal have random numbers of their own, and a point that leaves the aperture
 * is refused.
 */
#include "tests/support/rooms.h"
#include "tests/support/starts.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/mutation/mutation.h"
#include "worker/render/mutation/trace.h"
#include "worker/render/math/logsum.h"
#include "worker/render/path/ensemble.h"
#include "worker/render/path/full_path_density.h"
#include "worker/render/path/integrator.h"
#include "worker/render/world/build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { TRIALS = 3000, EDGES = 12 };

static struct path_context c;
static uint64_t counters[BATCH_COUNTERS];
static struct ensemble pair_drawn, pair_around_x, pair_capped;
static struct full_path x, y;

static void begin(const struct world *w)
{
	starts_init_context(&c, w, 1, STARTS_EDGES_MAX, counters);
	c.max_depth = EDGES;
}

/* Returns the probability that a sub-path may have `vertices` vertices or more: (5/n)^2 for n > 5, else 1. */
static double length_probability(unsigned vertices)
{
	return vertices > 5 ? 25.0 / (vertices * vertices) : 1;
}

/* Stores the path of candidate k of the current pair in x. Returns false if it lies just outside the film. */
static bool choose_candidate(unsigned k)
{
	double before = 0;
	for (unsigned j = 0; j < k; j++)
		before += pair_drawn.candidates[j].intensity;
	return ensemble_choose(&c, &pair_drawn, (before + 0.5 * pair_drawn.candidates[k].intensity) / pair_drawn.total,
			       &x);
}

static void draw_pair(uint64_t seed, uint64_t i, const struct ensemble_lengths *n, struct ensemble *out)
{
	struct sampler_random s;
	sampler_random_init(&s, seed, RNG_TEST, i, 0);
	ensemble_draw(&c, &s.base, n, out);
}

/* Returns whether the ensemble has a candidate of this length and intensity. If x is refracted at x_1, its candidate
 * by technique 1 is skipped: the refracted connection has vertices of its own. */
static bool has_candidate(const struct ensemble *e, unsigned edges, double intensity, bool whole)
{
	for (unsigned i = 0; i < e->count; i++) {
		const struct candidate *a = &e->candidates[i];
		if (!whole && a->s == 1 && a->passed_count == 0 && path_vertex_is_refracting(&x.v[1]))
			continue;
		double expected = whole ? intensity
					: intensity / (length_probability(edges + 1 - a->s - a->passed_count) *
						       length_probability(a->s));
		if (a->edges == edges && fabs(a->intensity / expected - 1) < 1e-6)
			return true;
	}
	return false;
}

/* Each candidate of a pair around a path contributes the value computed from its own full path. Returns the number of
 * candidates checked. */
static unsigned check_candidates(const char *name)
{
	unsigned checked = 0;
	double before = 0;
	for (unsigned k = 0; k < pair_around_x.count; before += pair_around_x.candidates[k++].intensity) {
		const struct candidate *a = &pair_around_x.candidates[k];
		double log_pdf[FULL_PATH_VERTICES_MAX];
		/* The path's own point on the emitter differs from the one that the random numbers draw. */
		bool own = a->s == 1 && a->edges == x.edges;
		if (own || a->intensity < 1e-6 * pair_around_x.total ||
		    !ensemble_choose(&c, &pair_around_x, (before + 0.5 * a->intensity) / pair_around_x.total, &y))
			continue;
		for (unsigned i = 0; i <= y.edges; i++)
			assert_true(y.v[i].x.prim.time == full_path_time(&x));
		full_path_log_technique_pdfs(&c, &y, log_pdf);
		double chances = length_probability(y.edges + 1 - a->s - a->passed_count) * length_probability(a->s),
		       want = exp(full_path_log_f(&c, &y) - log_sum_exp(log_pdf, y.edges + 1)) / chances;
		if (!(fabs(a->intensity / want - 1) < 1e-6))
			fail_msg("%s: %u edges by technique %u: %.9g, not %.9g", name, y.edges, a->s, a->intensity,
				 want);
		checked++;
	}
	return checked;
}

/* The path's own candidate, in a pair around the path, contributes the same as when it was found, divided by the
 * probability of the lengths. */
static void check_own_candidate(const char *name)
{
	struct world *w = room_build_named(name);
	uint64_t seed = stats_seed(name);
	unsigned checked = 0, longest = 0, others = 0;
	begin(w);
	const struct ensemble_lengths all = ensemble_max_lengths(&c);
	for (uint64_t i = 0; i < TRIALS; i++) {
		draw_pair(seed, i, &all, &pair_drawn);
		if (pair_drawn.count == 0)
			continue;
		unsigned k = (unsigned)(i % pair_drawn.count);
		const struct candidate own = pair_drawn.candidates[k];
		const double u[3] = {(double)i / TRIALS, 0.5, 0.5};
		struct sampler_random s;
		/* Far out in the tail of a lobe, its two evaluations share no digits. */
		if (own.intensity < 1e-6 * pair_drawn.total || !choose_candidate(k))
			continue;
		sampler_random_init(&s, seed, RNG_TEST, i, 1);
		c.time = (double)i / TRIALS; /* any time, as left by the previous draw */
		ensemble_draw_containing(&c, &s.base, &x, u, &pair_around_x);
		if (!has_candidate(&pair_around_x, own.edges, own.intensity, false))
			fail_msg("%s: pair %llu: a path of %u edges found by technique %u with %.9g is not there", name,
				 (unsigned long long)i, own.edges, own.s, own.intensity);
		checked++;
		longest += own.edges > 5;
		others += check_candidates(name);
	}
	print_message("%s: %u paths, %u of more than 5 edges, %u candidates\n", name, checked, longest, others);
	assert_true(checked > TRIALS / 4 && longest > 20);
	world_free(w);
}

static void path_contributes_the_same_in_a_pair_around_it(void **state)
{
	(void)state;
	check_own_candidate("gold");
	check_own_candidate("rough glass");
	check_own_candidate("coloured glass");
	check_own_candidate("bent normals");
	check_own_candidate("mirror");
	check_own_candidate("clouds");
	check_own_candidate("fog");
	check_own_candidate("moving");
}

/* Where lengths are drawn, the weight of a candidate is the reciprocal of the probability that both sub-paths are
 * long enough for it. */
static void drawn_lengths_are_weighted_by_their_probability(void **state)
{
	(void)state;
	struct world *w = room_build_named("gold");
	uint64_t seed = stats_seed("drawn lengths");
	unsigned checked = 0;
	begin(w);
	const struct ensemble_lengths all = ensemble_max_lengths(&c);
	for (uint64_t i = 0; i < TRIALS; i++) {
		const double u[2] = {(double)i / TRIALS, (double)(i * 7 % TRIALS) / TRIALS};
		const struct ensemble_lengths some = ensemble_draw_lengths(&c, u, 1, 1);
		draw_pair(seed, i, &some, &pair_capped);
		draw_pair(seed, i, &all, &pair_drawn);
		for (unsigned k = 0; k < pair_capped.count; k++) {
			const struct candidate *a = &pair_capped.candidates[k];
			unsigned t = a->edges + 1 - a->s;
			assert_true(t <= some.max_camera && a->s <= some.max_light);
			assert_true(has_candidate(&pair_drawn, a->edges,
						  a->intensity * length_probability(t) * length_probability(a->s),
						  true));
			checked += length_probability(t) * length_probability(a->s) < 1;
		}
	}
	assert_true(checked > 100);
	world_free(w);
}

static void lengths_have_their_stated_probability(void **state)
{
	(void)state;
	enum { N = 100000 };
	static unsigned count[2][EDGES + 3];
	c.max_depth = EDGES;
	for (unsigned least = 1; least <= 8; least += 7) {
		unsigned sure = least > 5 ? least : 5;
		memset(count, 0, sizeof count);
		for (int i = 0; i < N; i++) {
			const double u[2] = {(i + 0.5) / N, 1 - (i + 0.5) / N};
			struct ensemble_lengths n = ensemble_draw_lengths(&c, u, least, least);
			assert_true(n.max_camera >= sure && n.max_camera <= EDGES + 1 && n.max_light >= sure &&
				    n.max_light <= EDGES);
			for (unsigned k = 0; k <= n.max_camera; k++)
				count[0][k]++;
			for (unsigned k = 0; k <= n.max_light; k++)
				count[1][k]++;
		}
		for (unsigned side = 0; side < 2; side++)
			for (unsigned k = sure; k <= EDGES + 1 - side; k++)
				assert_true(fabs(count[side][k] / (double)N - (double)(sure * sure) / (k * k)) <
					    2.0 / N);
	}
}

/* The totals of both pairs against pairs drawn with the proposal's own random numbers; the pair around x must not use
 * the numbers of the other pair. */
static void both_pairs_of_a_proposal_use_their_own_numbers(void **state)
{
	(void)state;
	struct world *w = room_build_named("gold");
	const struct mutation_ops *ops = mutation_find("bidirectional", strlen("bidirectional"));
	static struct mutation_ctx m;
	static uint64_t count[STRATEGY_COUNTERS];
	uint64_t seed = stats_seed("streams");
	unsigned proposed = 0, same = 0;
	begin(w);
	const struct ensemble_lengths all = ensemble_max_lengths(&c);
	m = (struct mutation_ctx){.path = &c,
				  .seed = seed,
				  .chain = 5,
				  .counters = count,
				  .limits = walk_limits_of(&accuracy_settings_default)};
	for (uint64_t i = 0; i < TRIALS / 4; i++) {
		draw_pair(seed, i, &all, &pair_drawn);
		if (pair_drawn.count == 0 || !choose_candidate(0))
			continue;
		struct proposal_move move = {0};
		m.step = i;
		if (ops->propose(ops, &m, &(struct mutation_forced_choice){-1, -1}, &x, &y, &move) != PROPOSAL_MADE)
			continue;
		double total[2], v[4], r[4];
		const enum rng_stream stream[2] = {RNG_BIDIRECTIONAL_MUTATION, RNG_CHAIN};
		struct sampler_random s;
		mutation_draw_uniforms(&m, BLOCK_VERTEX + 1, v);
		for (int k = 0; k < 2; k++) {
			sampler_random_init(&s, seed, stream[k], m.chain, m.step);
			ensemble_draw_containing(&c, &s.base, &x, v, &pair_around_x);
			total[k] = pair_around_x.total;
		}
		assert_true(move.log_density[MUTATION_REVERSE] == -log(total[0]));
		same += total[0] == total[1];
		mutation_draw_uniforms(&m, BLOCK_VERTEX, r);
		const struct ensemble_lengths n = ensemble_draw_lengths(&c, r, 1, 1);
		sampler_random_init(&s, seed, RNG_CHAIN, m.chain, m.step);
		ensemble_draw(&c, &s.base, &n, &pair_drawn);
		assert_true(move.log_density[MUTATION_FORWARD] == -log(pair_drawn.total));
		proposed++;
	}
	print_message("%u proposals, in %u the pair around the state does not depend on its numbers\n", proposed, same);
	assert_true(proposed > 50 && same < proposed / 2);
	world_free(w);
}

/* The intensity of a sample of hslt's bootstrap is the total of the candidates for its seed: a chain starts at one of
 * them. */
static void bootstrap_intensity_is_the_total_of_candidates(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		32, 32,
		SENSOR("0,0,4", "0,0,0") "<shape type='sphere'><bsdf type='diffuse'/></shape>"
					 "<shape type='sphere'><point name='center' x='1.2' y='0' z='1'/>"
					 "<float name='radius' value='.1'/><emitter type='area'/></shape>");
	const struct integrator *hslt = integrator_find("hslt");
	const uint64_t seed = stats_seed("bootstrap of candidates");
	unsigned lit = 0;
	begin(w);
	const struct ensemble_lengths all = ensemble_max_lengths(&c);
	for (uint64_t i = 0; i < TRIALS; i++) {
		static struct path_sample sample;
		struct sampler_random s;
		sampler_random_init(&s, seed, RNG_TEST, i, 0);
		hslt->evaluate(&c, &s.base, &sample);
		draw_pair(seed, i, &all, &pair_drawn);
		if (!(fabs(sample.intensity - pair_drawn.total) <= 1e-9 * pair_drawn.total))
			fail_msg("sample %u: worth %g, its candidates %g", (unsigned)i, sample.intensity,
				 pair_drawn.total);
		lit += pair_drawn.total > 0;
	}
	assert_true(lit > TRIALS / 10);
	world_free(w);
}

/* From a point next to the aperture's rim, half of the steps lead out of the aperture and are refused: if they were
 * clamped to the rim, points would gather there. 1,000 steps; a share outside 0.42 to 0.58 has a probability below
 * 1e-6. */
static void steps_beyond_the_aperture_are_refused(void **state)
{
	(void)state;
	struct world *w = room_build_named("lens");
	static struct mutation_ctx m;
	const double rim[2] = {0.999999, 0.5};
	unsigned refused = 0;
	begin(w);
	m = (struct mutation_ctx){.path = &c, .seed = stats_seed("aperture"), .chain = 1};
	x.edges = y.edges = 2;
	x.v[2].x.p = camera_sample_point(&w->camera, rim);
	for (m.step = 0; m.step < 1000; m.step++) {
		double u[2];
		if (!trace_move_aperture(&m, &x, &y)) {
			refused++;
			continue;
		}
		camera_point_inverse(&w->camera, y.v[2].x.p, u);
		assert_true(u[0] < rim[0] + 1e-9);
	}
	assert_true(refused > 420 && refused < 580);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(path_contributes_the_same_in_a_pair_around_it),
		cmocka_unit_test(drawn_lengths_are_weighted_by_their_probability),
		cmocka_unit_test(lengths_have_their_stated_probability),
		cmocka_unit_test(both_pairs_of_a_proposal_use_their_own_numbers),
		cmocka_unit_test(bootstrap_intensity_is_the_total_of_candidates),
		cmocka_unit_test(steps_beyond_the_aperture_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
