/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Whole paths in exact proportion to f, for tests of what a Markov chain does with them: the paths that bdpt makes of
 * independent pairs of sub-paths, resampled by what each contributes there. A group's paths are independent of all
 * other groups'; within one they may repeat. One thread.
 */
#ifndef TESTS_SUPPORT_STARTS_H
#define TESTS_SUPPORT_STARTS_H

#include "worker/render/path/full_path.h"

enum { STARTS_MAX_EDGES = 8 };

struct start { /* technique s of that pair of sub-paths */
	uint64_t index;
	unsigned s, passed;
	double sum; /* of the contributions up to here */
};

struct starts {
	struct path_context *c;
	uint64_t seed;
	struct {
		struct start *at;
		size_t count, room;
	} of[STARTS_MAX_EDGES + 1]; /* by number of edges */
	uint64_t pairs;
};

/* A context for films of 32 x 32 and paths of min_depth..max_depth edges; counters are the caller's. */
void starts_context(struct path_context *c, const struct world *w, unsigned min_depth, unsigned max_depth,
		    uint64_t *counters);

/* The group's own pairs. starts_fini frees. */
void starts_init(struct starts *s, struct path_context *c, uint64_t seed, uint64_t group, uint64_t pairs);
void starts_fini(struct starts *s);

/* Contribution of all paths of that many edges, per pair: its expectation is the integral of f. */
double starts_weight(const struct starts *s, unsigned edges);

/* The path at u in [0,1) of the sum. false: there is none (or it lies just outside the film's border). */
bool starts_path(struct starts *s, unsigned edges, double u, struct full_path *x);

#endif
