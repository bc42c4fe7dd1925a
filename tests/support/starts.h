/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Whole paths in exact proportion to f, for tests of what a Markov chain makes of them: the paths that bdpt makes of
 * independent pairs of sub-paths, resampled by their contributions. The paths of a group are independent of those of
 * all other groups; within a group they may repeat. One thread.
 */
#ifndef TESTS_SUPPORT_STARTS_H
#define TESTS_SUPPORT_STARTS_H

#include "worker/render/path/full_path.h"

enum { STARTS_EDGES_MAX = 8 };

struct start { /* `technique` of pair `index` of sub-paths */
	uint64_t index;
	unsigned technique, passed_count;
	double cumulative; /* sum of the contributions up to this one */
};

struct starts {
	struct path_context *c;
	uint64_t seed;
	struct {
		struct start *items;
		size_t count, capacity;
	} by_edges[STARTS_EDGES_MAX + 1];
	uint64_t pairs;
};

/* Makes a context for films of 32 x 32 and paths of min_depth..max_depth edges; the caller owns the counters. */
void starts_init_context(struct path_context *c, const struct world *w, unsigned min_depth, unsigned max_depth,
			 uint64_t *counters);

/* Samples the group's own pairs. starts_fini frees them. */
void starts_init(struct starts *s, struct path_context *c, uint64_t seed, uint64_t group, uint64_t pairs);
void starts_fini(struct starts *s);

/* Returns the contribution of all paths with that number of edges, per pair: its expectation is the integral of f. */
double starts_contribution(const struct starts *s, unsigned edges);

/* Makes the path at the fraction u in [0,1) of the sum. Returns false if there is none (or if it lies just outside
 * the film's border). */
bool starts_make_path(struct starts *s, unsigned edges, double u, struct full_path *x);

#endif
