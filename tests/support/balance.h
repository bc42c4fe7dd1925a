/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Detailed balance of mutations, shown or refuted: with X in proportion to f (tests/support/starts.h) and one proposal
 * Y with acceptance probability a, E[a phi(X, Y)] = 0 for every antisymmetric phi. phi is the sign of g(Y) - g(X) for
 * some twenty functions g (film, intensity, wavelength, positions, half vectors, lengths), the differences of the parts
 * of the densities themselves, cut off at 1, and whether y's walk fails to lead back.
 *
 * Level: 1e-4 for all comparisons of the suite together, shared equally; Student's t between 64 independent groups of
 * starts. Power: the smallest relative fault of the ratio T(X->Y) / T(Y->X), the same for all pairs on one side of some
 * g, that is found with 95 % probability. Every accepted proposal goes through path_check, and a rejected one must
 * leave y as x was.
 */
#ifndef TESTS_SUPPORT_BALANCE_H
#define TESTS_SUPPORT_BALANCE_H

#include "tests/support/starts.h"
#include "worker/render/mutation/mutation.h"

enum { BALANCE_GROUPS = 64, BALANCE_FUNCTIONS = 28, BALANCE_EDGES_MAX = 5 };

enum balance_side { BALANCE_ANY, BALANCE_CAMERA, BALANCE_TRACED }; /* the forced b: any path, b = k, b < k */

struct balance_trial {
	const struct mutation_ops *ops;
	struct mutation_forced_choice setting;
	enum balance_side side;
	unsigned proposals_per_start;
	bool is_broken; /* a deliberately broken mutation: paths are not checked */
	uint64_t pairs, accepted, counters[STRATEGY_COUNTERS];
	double acceptance_sum; /* sum of the acceptance probabilities a */
	/* sums of a phi and a |phi| */
	double phi_sum[BALANCE_GROUPS][BALANCE_FUNCTIONS], abs_phi_sum[BALANCE_GROUPS][BALANCE_FUNCTIONS];
};

struct balance_verdict {
	double t, p, power; /* t, p: of the worst function; power: the smallest fault that the best function finds */
	double fault;	    /* the relative fault of the ratio that the worst function shows */
	const char *function_name;
	bool is_balanced;
};

/* Runs all trials from the same starts: `starts` for each number of edges from each group, chosen among `pairs`
 * pairs of sub-paths per group. */
void balance_run(const struct world *w, const char *test, struct balance_trial *trials, size_t count, size_t starts,
		 size_t pairs);
struct balance_verdict balance_judge(const struct balance_trial *t);
void balance_format_name(const struct balance_trial *t, char text[48]);
/* Combines the same strategy's results in several worlds: a relative fault that all worlds share is found from all
 * of them together, each weighted by its precision. Initialize with zeros. */
struct balance_pool {
	/* Sums of 1 / error^2, and of the faults times that. */
	double precision[BALANCE_FUNCTIONS], weighted_fault[BALANCE_FUNCTIONS];
};
void balance_pool_add(struct balance_pool *p, const struct balance_trial *t);
struct balance_verdict balance_pool_judge(const struct balance_pool *p);

/* Prints a line of a table: pairs, accepted, the worst t and the power. */
void balance_print(const char *test, const struct balance_trial *t, const struct balance_verdict *v);

#endif
