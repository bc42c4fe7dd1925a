/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The predictor-corrector walk (Hanika, Kaplanyan, Dachsbacher 2015, sec. 3 and 6; Jakob 2013): moves the inner
 * vertices of a sub-path between two fixed ends until their half vectors have given values.
 *
 * A Newton step moves every vertex in its tangent plane. Starting at the camera's end, each is put back onto the
 * surface along the ray from the previous one: on its old primitive if that is still hit, otherwise by casting a ray.
 * Only the final path must be visible: its edges are tested at the end, unless the caller knows that they are (a
 * reverse walk to an existing path). One thread; nothing allocates.
 */
#ifndef WORKER_RENDER_HALFVEC_WALK_H
#define WORKER_RENDER_HALFVEC_WALK_H

#include "worker/render/halfvec/constraint.h"

/* Why a walk failed: the reason for which its last trial was rejected. */
enum walk_end {
	WALK_OK,
	WALK_MISSED,	 /* a ray hit nothing */
	WALK_BLOCKED,	 /* another material, or an edge is occluded */
	WALK_MODE,	 /* a vertex would scatter in another mode, or the normals disagree about a side */
	WALK_SINGULAR,	 /* the matrix is singular, or two vertices coincide */
	WALK_DIVERGED,	 /* the residuals grew, however short the step */
	WALK_ITERATIONS, /* too many iterations, although the residuals still shrank */
};

/* Tolerance of a half vector whose target is 0, at the end of a walk. */
#define WALK_SPECULAR_TOLERANCE 1e-9
/* The tolerances of a reverse walk: with those of a forward walk, 2 to 11 % of the reverse walks miss the path where
 * that began only because of them. */
#define WALK_BACK_SCALE 0.1

struct walk_limits {
	unsigned iterations;
	double least_step; /* of a Newton step */
	double scale;	   /* of all tolerances: 1, or 0.5 to show that they do not change the image */
	double tolerance;  /* of a vertex at the end of a walk: distance of the half vector from its target, relative to
			      the smaller of lobe and step */
	double back; /* how near to its start the reverse walk must end, relative to the largest step that a vertex made
		      */
	const struct constraint_solver *solver;
};
struct walk_limits walk_limits_of(const struct accuracy_settings *k);

struct walk_target {
	vec2 h;		  /* of the vertex at the end of the walk, in its frame; (0,0) if specular */
	double tolerance; /* of |h - target| */
};

/* Caller's storage for one walk. */
struct walk_scratch {
	struct constraint k[FULL_PATH_MAX_VERTICES];
	struct constraint_system system;
	vec2 residual[FULL_PATH_MAX_VERTICES], dx[FULL_PATH_MAX_VERTICES];
	struct path_vertex kept[FULL_PATH_MAX_VERTICES];
	unsigned iterations; /* output: of the last walk */
};

/* What is stale of s->k and s->system, which belong to the path where the walk starts: nothing; the constraint next
 * to an end that has moved since, and the system; everything. */
enum walk_stale { WALK_STALE_B = 1, WALK_STALE_C = 2, WALK_STALE = 4 };

/* y: vertices b and c stay; b-1..c+1 are where the walk starts, and on WALK_OK where it ended, with edges c..b-1
 * joined. Wavelengths (indices of refraction) are y's. On WALK_OK s->k has the constraints there, except after a
 * reverse walk. visible: a reverse walk, whose edges the caller knows to be unoccluded, to WALK_BACK_SCALE of the
 * tolerances: this decides reliably whether it finds the path again, and takes 0.2 more iterations and no rays. Its
 * iterations are limited as a forward walk's until it is where that would end, as detailed balance requires: what can
 * be proposed from y can then be found from there, however few iterations there may be. On failure y's vertices
 * c+1..b-1 are undefined. Cached values of f there are dropped. */
enum walk_end halfvec_walk(struct path_context *c, struct full_path *y, unsigned b, unsigned c_end,
			   const struct walk_target *target, bool visible, const struct walk_limits *limits,
			   unsigned stale, struct walk_scratch *s);

#endif
