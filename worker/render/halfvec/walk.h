/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The predictor-corrector walk (Hanika, Kaplanyan, Dachsbacher 2015, sec. 3 and 6; Jakob 2013): moves the inner
 * vertices of a sub-path between two fixed ends until their half vectors have given values.
 *
 * A Newton step moves every vertex in its tangent plane. Starting at the camera's end, each vertex is projected back
 * onto the surface along the ray from the previous one: onto its old primitive if the ray still hits that, otherwise by
 * tracing the ray. Only the final path must be visible: its edges are tested at the end, unless the caller knows that
 * they are unoccluded (a reverse walk to an existing path). One thread; nothing allocates.
 */
#ifndef WORKER_RENDER_HALFVEC_WALK_H
#define WORKER_RENDER_HALFVEC_WALK_H

#include "worker/render/halfvec/constraint.h"

/* Why a walk failed: the reason for which its last trial was rejected. */
enum walk_result {
	WALK_OK,
	WALK_MISSED,	      /* a ray hit nothing */
	WALK_BLOCKED,	      /* another material was hit, or an edge is occluded */
	WALK_MODE_CHANGED,    /* a vertex would scatter in another mode, or the normals disagree about a side */
	WALK_SINGULAR,	      /* the matrix is singular, or two vertices coincide */
	WALK_DIVERGED,	      /* the residuals grew, however short the step */
	WALK_ITERATION_LIMIT, /* the iterations ran out while the residuals still shrank */
};

/* Tolerance of a half vector whose target is 0, at the end of a walk. */
#define WALK_SPECULAR_TOLERANCE 1e-9
/* Factor on the tolerances of a reverse walk. With those of a forward walk, 2 to 11 % of the reverse walks would miss
 * the original path for no other reason. */
#define WALK_REVERSE_SCALE 0.1

struct walk_limits {
	unsigned max_iterations;
	double min_step;	/* smallest factor on a Newton step */
	double tolerance_scale; /* factor on all tolerances: 1, or 0.5 to show that they do not change the image */
	/* At the end of a walk, tolerance of the distance of a half vector from its target, relative to the
	 * smaller of lobe width and step. */
	double tolerance;
	/* Largest distance between the end of a reverse walk and the original path, relative to the
	 * largest step of any vertex. */
	double reverse_tolerance;
	const struct constraint_solver *solver;
};
struct walk_limits walk_limits_of(const struct accuracy_settings *k);

struct walk_target {
	/* Half vector of the vertex at the end of the walk, in the vertex's frame there; (0,0) if specular. */
	vec2 h;
	double tolerance; /* limit on |h - target| */
};

/* Caller's storage for one walk. */
struct walk_scratch {
	struct constraint k[FULL_PATH_VERTICES_MAX];
	struct constraint_system system;
	vec2 residual[FULL_PATH_VERTICES_MAX], dx[FULL_PATH_VERTICES_MAX];
	struct path_vertex accepted[FULL_PATH_VERTICES_MAX];
	unsigned iterations; /* output: iterations of the last walk */
};

/* Which parts of s->k and s->system, which belong to the path where the walk starts, are stale: nothing (0);
 * the constraint next to an end that has moved since, and the system (WALK_STALE_B, WALK_STALE_C); or
 * everything (WALK_STALE_ALL). */
enum walk_stale { WALK_STALE_B = 1, WALK_STALE_C = 2, WALK_STALE_ALL = 4 };

/* Moves the vertices c_end+1..b-1 of y from where they are until their half vectors have the targets; vertices b and
 * c_end stay. On WALK_OK the edges c_end..b-1 are joined and, except after a reverse walk, s->k has the constraints
 * there. Wavelengths (refractive indices) are y's.
 *
 * is_reverse: a reverse walk, whose edges the caller knows to be unoccluded. Its tolerances are multiplied by
 * WALK_REVERSE_SCALE, which decides reliably whether it finds the original path again, and costs 0.2 more iterations
 * and no rays. Until it is within the tolerances of a forward walk its iterations are limited like a forward walk's, as
 * detailed balance requires: a path that y can propose must be found from y however few iterations are allowed.
 *
 * On failure y's vertices c_end+1..b-1 are undefined. Their cached values of f are dropped in any case. */
enum walk_result halfvec_walk(struct path_context *c, struct full_path *y, unsigned b, unsigned c_end,
			      const struct walk_target *target, bool is_reverse, const struct walk_limits *limits,
			      unsigned stale, struct walk_scratch *s);

#endif
