/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All paths that one pair of sub-paths makes, each with its contribution by the balance heuristic: what bdpt averages,
 * seen as candidates of which one can be drawn in proportion to its contribution.
 *
 * Sub-paths have n > 5 or more vertices with probability (5 / n)^2; contributions are divided by it, so that their
 * expected sum stays the integral. That a path x is among the candidates of a random pair can be turned round:
 * ensemble_around draws a pair as it would be had x been drawn from it. One thread; nothing allocates.
 */
#ifndef WORKER_RENDER_PATH_ENSEMBLE_H
#define WORKER_RENDER_PATH_ENSEMBLE_H

#include "worker/render/path/full_path.h"

struct candidate {
	double intensity;
	unsigned s, passed, edges; /* passed: vertices that the joint passes (transparent.h); `edges` counts theirs */
};

struct ensemble {
	double total; /* sum of intensities */
	unsigned count;
	struct candidate of[FULL_PATH_MAX_VERTICES * FULL_PATH_MAX_VERTICES];
};

struct ensemble_lengths {
	unsigned camera, light; /* vertices that the sub-paths may have */
	bool capped;		/* by chance; else they are as long as they come */
};

/* Lengths from two numbers in [0,1), at least `camera` and `light`. */
struct ensemble_lengths ensemble_lengths_of(const struct path_context *c, const double u[2], unsigned camera,
					    unsigned light);
struct ensemble_lengths ensemble_all_lengths(const struct path_context *c);

/* Draws a pair of sub-paths into c and gathers its candidates. */
void ensemble_draw(struct path_context *c, struct sampler *s, const struct ensemble_lengths *n, struct ensemble *out);
/* A pair among whose candidates x is. u: three numbers in [0,1), for the technique and the lengths. */
void ensemble_around(struct path_context *c, struct sampler *s, struct full_path *x, const double u[3],
		     struct ensemble *out);

/* The candidate that u in [0,1) chooses, as a path; only right after ensemble_draw. false: there is none. */
bool ensemble_choose(struct path_context *c, const struct ensemble *e, double u, struct full_path *x);

#endif
