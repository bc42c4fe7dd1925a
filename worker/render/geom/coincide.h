/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Coinciding surfaces: triangles that overlap in one plane as far as float vertices can tell, and equal spheres.
 * (Curves are not compared; no scene is known that has the same curve twice.) Which of them a ray hits would be
 * left to chance, and sampling a point on one of them would ignore the others. So one rule applies everywhere:
 * where several surfaces coincide, only the one of the lowest rank is present; of equal ranks, the first. The
 * others are hidden there.
 *
 * Coincidences are found once, before Embree's tree is built: small meshes and triangles are sorted into smaller and
 * smaller boxes, as long as a box holds more than one shape or an emitter (points on emitters are sampled by area, so a
 * duplicate triangle would count twice). Triangles of one shape that does not emit are not compared with each other,
 * because it does not matter which of them is hit. Work and memory are bounded in proportion to the number of
 * triangles; if the bound is reached, the coincidences found so far apply and `incomplete` is set.
 *
 * The result is immutable: any thread. Finding allocates and ticks (common/base/liveness.h); queries do not.
 */
#ifndef WORKER_RENDER_GEOM_COINCIDE_H
#define WORKER_RENDER_GEOM_COINCIDE_H

#include "worker/render/geom/primitive.h"
#include "worker/render/geom/triangle.h"

#include <stddef.h>
#include "common/base/error.h"

/* A primitive that another one hides, in part or entirely, within the rounding of vertices. */
struct coincide_pair {
	struct prim_ref hidden, by;
	enum surface_rank rank; /* rank of `by` */
	bool wholly;
	bool same_side; /* their normals point to the same side */
};

/* Two shapes with coinciding primitives. */
struct coincide_shapes {
	uint32_t hidden, by;
	bool same_side; /* some of these primitives have normals that point to the same side */
};

struct coincidence {
	size_t pair_count, shapes_count;
	struct coincide_pair *pairs;	/* sorted by hidden shape, hidden primitive, and rank of `by` */
	struct coincide_shapes *shapes; /* each pair of shapes once, in the same order */
	/* One entry per shape, plus one: the index of its first pair. */
	size_t *first;
	bool incomplete;
};

void coincide_free(struct coincidence *c);

/* Returns the primitive that is present at the point p of `prim`: `prim` itself, or the one that
 * hides it. c may be NULL. */
struct prim_ref coincide_there(const struct coincidence *c, const struct accel_shape *shapes, struct prim_ref prim,
			       vec3 p);

/* The sine of the angle between coinciding triangles is at most this many times the distance by which rounding moves
 * their vertices, divided by the smaller altitude of the two, as if two vertices of either were moved to opposite
 * sides, twice. Planes at a larger angle cross. */
#define COINCIDE_TILT 4.0

/* The orientation of a triangle. */
struct coincide_facing {
	vec3 n; /* unit normal; 0: unknown */
	double altitude, rounded;
};

struct coincide_facing coincide_facing_of(const struct triangle *t);

/* A quick test for whether two triangles differ in direction so much that coincide_triangles is false, if their
 * vertices have no errors besides rounding. */
static inline bool coincide_faces_away(const struct coincide_facing *a, const struct coincide_facing *b)
{
	vec3 across = vec3_cross(a->n, b->n);
	double low = a->altitude < b->altitude ? a->altitude : b->altitude,
	       off = COINCIDE_TILT * (a->rounded + b->rounded);
	return vec3_dot(across, across) * low * low > off * off;
}

/* Whether triangle a overlaps b in its plane by more than touching neighbours do because of rounding. off: the error of
 * their vertices in addition to the rounding of coordinates to float (struct placement). *wholly: b covers all of a. */
bool coincide_triangles(const struct triangle *a, const struct triangle *b, double off, bool *wholly);

/* Whether two spheres are equal within the rounding of floats. */
bool coincide_spheres(const struct accel_shape *a, const struct accel_shape *b);

#endif
