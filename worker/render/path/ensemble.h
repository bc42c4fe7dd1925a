/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All paths that one pair of sub-paths makes, each with its contribution weighted by the balance
 * heuristic. bdpt averages these contributions; here the paths are candidates, one of which can be drawn
 * in proportion to its contribution.
 *
 * A sub-path has n or more vertices, for n > 5, with probability (5 / n)^2; contributions are divided by this
 * probability, so that their expected sum stays the integral. The relation "path x is a candidate of a random pair" can
 * be inverted: ensemble_draw_containing draws a pair with the distribution that it has given that x was drawn from it.
 * One thread; nothing allocates.
 */
#ifndef WORKER_RENDER_PATH_ENSEMBLE_H
#define WORKER_RENDER_PATH_ENSEMBLE_H

#include "worker/render/path/full_path.h"

struct candidate {
	double intensity;
	/* passed_count: number of vertices that the joint passes (transparent.h) or at which it is refracted;
	 * `edges` includes theirs. */
	unsigned s, passed_count, edges;
};

struct ensemble {
	double total; /* sum of intensities */
	unsigned count;
	struct candidate candidates[FULL_PATH_VERTICES_MAX * FULL_PATH_VERTICES_MAX];
};

struct ensemble_lengths {
	unsigned max_camera, max_light; /* maximum numbers of vertices of the sub-paths */
	bool is_randomized;		/* the maxima were drawn at random; otherwise they are the depth limits */
};

/* Draws maximum lengths from two numbers in [0,1); they are at least `camera` and `light`. */
struct ensemble_lengths ensemble_draw_lengths(const struct path_context *c, const double u[2], unsigned camera,
					      unsigned light);
struct ensemble_lengths ensemble_max_lengths(const struct path_context *c);

/* Draws a pair of sub-paths into c and gathers its candidates. */
void ensemble_draw(struct path_context *c, struct sampler *s, const struct ensemble_lengths *n, struct ensemble *out);
/* Draws a pair of sub-paths that has x among its candidates. u: three numbers in [0,1), for the
 * technique and the lengths. */
void ensemble_draw_containing(struct path_context *c, struct sampler *sampler, struct full_path *x, const double u[3],
			      struct ensemble *out);

/* Builds the path of the candidate that u in [0,1) chooses. Must directly follow ensemble_draw or
 * ensemble_draw_containing. Returns false if there is no candidate or its path cannot be built. */
bool ensemble_choose(struct path_context *c, const struct ensemble *e, double u, struct full_path *x);

#endif
