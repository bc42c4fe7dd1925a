/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Detailed balance of mutations, shown or refuted: X in proportion to f (tests/support/starts.h), one proposal Y with
 * its acceptance a, and for every antisymmetric phi E[a phi(X, Y)] = 0. phi is the sign of g(Y) - g(X) for some twenty
 * g (film, intensity, wavelength, positions, half vectors, lengths), the differences of the parts of the densities
 * themselves, cut off at 1, and whether y's walk fails to lead back.
 *
 * Level: 1e-4 for all comparisons of the suite together, shared equally; t between 64 independent groups of starts.
 * Power: the smallest relative fault of the ratio T(X->Y) / T(Y->X), the same for all pairs on one side of some g, that
 * is found with 95 % probability. Every accepted proposal goes through path_check, and a rejected one must leave y as x
 * was.
 */
#ifndef TESTS_SUPPORT_BALANCE_H
#define TESTS_SUPPORT_BALANCE_H

#include "tests/support/starts.h"
#include "worker/render/mutation/mutation.h"

enum { BALANCE_GROUPS = 64, BALANCE_FUNCTIONS = 28, BALANCE_EDGES = 5 };

enum balance_side { BALANCE_ANY, BALANCE_CAMERA, BALANCE_TRACED }; /* forced b: any path, b = k, b < k */

struct balance_trial {
	const struct mutation_ops *ops;
	struct mutation_setting how;
	enum balance_side side;
	unsigned repeat; /* proposals from each start */
	bool broken;	 /* on purpose: paths are not checked */
	uint64_t pairs, accepted, count[STRATEGY_COUNTERS];
	double expected;									/* sum of a */
	double sum[BALANCE_GROUPS][BALANCE_FUNCTIONS], size[BALANCE_GROUPS][BALANCE_FUNCTIONS]; /* of a phi, a |phi| */
};

struct balance_verdict {
	double t, p, power; /* of the worst function; the smallest fault found by the best */
	double fault;	    /* that the worst shows, as relative fault of the ratio */
	const char *function;
	bool balanced;
};

/* All trials from the same starts: `starts` of each number of edges from each group, out of `pairs` of sub-paths a
 * group. */
void balance_run(const struct world *w, const char *test, struct balance_trial *trials, size_t count, size_t starts,
		 size_t pairs);
struct balance_verdict balance_judge(const struct balance_trial *t);
void balance_name(const struct balance_trial *t, char text[48]);
/* The same strategy in several worlds: a relative fault that all of them share is found by all of them together, each
 * weighted by how well it tells. Begins as zeros. */
struct balance_pool {
	double certainty[BALANCE_FUNCTIONS],
		weighted[BALANCE_FUNCTIONS]; /* sums of 1 / error^2, and of the faults times that */
};
void balance_pool_add(struct balance_pool *p, const struct balance_trial *t);
struct balance_verdict balance_pool_judge(const struct balance_pool *p);

/* A line of a table: pairs, accepted, the worst t and the power. */
void balance_print(const char *test, const struct balance_trial *t, const struct balance_verdict *v);

#endif
