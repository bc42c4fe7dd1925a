/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Independent proposals estimate all light that reaches the film: the mean of f / T over them is the integral of f
 * that bdpt finds, for each number of edges and for all together. Chains are scaled by this estimate.
 *
 * Level: 1e-6 for all comparisons together, by t between 32 groups on each side. Power: the bias found with 95 %
 * probability is printed; for the strategy that chains use by default it is at most 2 % over all rooms, with FULL=1
 * in each room.
 */
#include "tests/support/dice.h"
#include "tests/support/test_length.h"
#include "tests/support/rooms.h"
#include "tests/support/starts.h"
#include "tests/support/stats.h"
#include "worker/render/mutation/mutation.h"
#include "worker/render/world/build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { GROUPS = 32, EDGES = 5 };
#define COMPARISONS 256
#define LEVEL (1e-6 / COMPARISONS)
/* |t| at this level with 31 degrees of freedom, plus the margin for a power of 95 %. */
#define DETECTABLE_T (8.5 + 1.7)

/* Adds to `mean` the means of f / T by number of edges. */
static void add_proposal_estimates(struct mutation_ctx *m, const struct mutation_ops *ops, size_t n, double *mean)
{
	static struct full_path x, y;
	static uint64_t count[STRATEGY_COUNTERS];
	m->counters = count;
	for (size_t i = 0; i < n; i++) {
		struct proposal_move move = {0};
		x.edges = 0;
		m->step++;
		if (ops->propose(ops, m, &(struct mutation_forced_choice){-1, -1}, &x, &y, &move) == PROPOSAL_MADE)
			mean[y.edges] += exp(ops->log_weight(m, &y, &move, MUTATION_FORWARD)) / (double)n;
	}
}

/* Relative differences of all light, pooled over rooms with the weights 1 / error^2. */
static struct pooled {
	double weight_sum, weighted_sum;
} pool;
static size_t rooms_pooled;

/* Factor by which the samples grow so that a room alone finds 2 %. */
static size_t sample_factor(void)
{
	return test_is_full() ? 8 : 1;
}

/* Compares each number of edges, and all together; returns the number of faults. */
static unsigned compare_estimates(const char *room, const char *strategy, double a[GROUPS][EDGES + 1],
				  double b[GROUPS][EDGES + 1])
{
	unsigned faults = 0;
	double worst = 0;
	struct stats_mean s = {0, 0, 1};
	double sum = 0;
	for (unsigned k = EDGES + 1; k-- > 0;) {
		double d[GROUPS] = {0};
		sum = 0;
		for (unsigned g = 0; g < GROUPS; g++)
			for (unsigned j = k ? k : 1; j <= (k ? k : EDGES); j++) {
				d[g] += a[g][j] - b[g][j];
				sum += b[g][j] / GROUPS;
			}
		s = stats_mean_test(d, GROUPS, 0);
		if (!(sum > 0))
			continue;
		faults += s.p < LEVEL;
		worst = fmax(worst, fabs(s.mean / s.error));
	}
	printf("%-14s %-14s all light %+6.2f %% +- %.2f %%, finds %.1f %%; largest t of a length %.2f\n", room,
	       strategy, 100 * s.mean / sum, 100 * s.error / sum, 100 * DETECTABLE_T * s.error / sum, worst);
	if (strcmp(strategy, "bidirectional") == 0) {
		double error = s.error / sum;
		pool.weight_sum += 1 / (error * error);
		pool.weighted_sum += s.mean / sum / (error * error);
		rooms_pooled++;
		faults += sample_factor() > 1 && dice_scaled_count(1000) > 1000 && !(DETECTABLE_T * error <= 0.02);
	}
	return faults;
}

static void independent_proposals_are_unbiased_over_all_rooms(void **state)
{
	(void)state;
	double error = 1 / sqrt(pool.weight_sum), t = pool.weighted_sum / pool.weight_sum / error;
	printf("all rooms      bidirectional  all light %+6.2f %% +- %.2f %%, finds %.2f %%\n", 100 * t * error,
	       100 * error, 100 * DETECTABLE_T * error);
	assert_true(rooms_pooled >= 10);
	assert_true(stats_student_t_p(t, GROUPS - 1) >= LEVEL);
	assert_true(DETECTABLE_T * error <= 0.02 || dice_scaled_count(1000) < 1000);
}

static void independent_proposals_have_the_integral_of_bdpt(void **state)
{
	const struct room *room = *state;
	static struct path_context c;
	static struct mutation_ctx m;
	static uint64_t counters[BATCH_COUNTERS];
	static double want[GROUPS][EDGES + 1];
	struct world *w = room->build();
	size_t n = dice_scaled_count(1000) * sample_factor();
	unsigned faults = 0;
	starts_init_context(&c, w, 1, EDGES, counters);
	m = (struct mutation_ctx){
		.path = &c, .seed = stats_seed(room->name), .limits = walk_limits_of(&accuracy_settings_default)};
	for (unsigned g = 0; g < GROUPS; g++) {
		struct starts s;
		starts_init(&s, &c, m.seed, g, n);
		for (unsigned k = 1; k <= EDGES; k++)
			want[g][k] = starts_contribution(&s, k);
		starts_fini(&s);
	}
	for (size_t i = 0; mutation_registry[i]; i++) {
		double mean[GROUPS][EDGES + 1] = {{0}};
		for (m.chain = 0; mutation_registry[i]->is_independent && m.chain < GROUPS; m.chain++)
			add_proposal_estimates(&m, mutation_registry[i], 2 * n, mean[m.chain]);
		if (mutation_registry[i]->is_independent)
			faults += compare_estimates(room->name, mutation_registry[i]->name, mean, want);
	}
	world_free(w);
	assert_true(faults == 0);
}

int main(void)
{
	struct CMUnitTest tests[ROOMS_MAX] = {0};
	size_t n = 0;
	for (const struct room *r = rooms; r->name; r++)
		tests[n++] = (struct CMUnitTest){r->name, independent_proposals_have_the_integral_of_bdpt, NULL, NULL,
						 (void *)(uintptr_t)r};
	tests[n++] =
		(struct CMUnitTest){"all rooms", independent_proposals_are_unbiased_over_all_rooms, NULL, NULL, NULL};
	return _cmocka_run_group_tests("estimate", tests, n, NULL, NULL);
}
