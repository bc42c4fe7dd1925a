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
 * triangles; if the bound is reached, the coincidences found so far apply and `is_incomplete` is set.
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
	struct prim_ref hidden, covering;
	enum surface_rank rank; /* rank of `covering` */
	bool covers_all;
	bool faces_same_side; /* their normals point to the same side */
};

/* Two shapes with coinciding primitives. */
struct coincide_shape_pair {
	uint32_t hidden, covering;
	bool faces_same_side; /* some of these primitives have normals that point to the same side */
};

struct coincidence {
	size_t pair_count, shape_pair_count;
	struct coincide_pair *pairs;		 /* sorted by hidden shape, hidden primitive, and rank of `covering` */
	struct coincide_shape_pair *shape_pairs; /* each pair of shapes once, in the same order */
	/* One entry per shape, plus one: the index of its first pair. */
	size_t *first_pair;
	bool is_incomplete;
};

void coincide_free(struct coincidence *c);

/* Returns the primitive that is present at the point p of `prim`: `prim` itself, or the one that
 * hides it. c may be NULL. */
struct prim_ref coincide_present_prim(const struct coincidence *c, const struct accel_shape *shapes,
				      struct prim_ref prim, vec3 p);

/* The sine of the angle between coinciding triangles is at most this many times the distance by which rounding moves
 * their vertices, divided by the smaller altitude of the two, as if two vertices of either were moved to opposite
 * sides, twice. Planes at a larger angle cross. */
#define COINCIDE_TILT 4.0

/* The orientation of a triangle. */
struct coincide_facing {
	vec3 n; /* unit normal; 0: unknown */
	double altitude, rounding;
};

struct coincide_facing coincide_facing_from_triangle(const struct triangle *t);

/* A quick test for whether two triangles differ in direction so much that coincide_triangles is false, if their
 * vertices have no errors besides rounding. */
static inline bool coincide_directions_differ(const struct coincide_facing *a, const struct coincide_facing *b)
{
	vec3 cross_product = vec3_cross(a->n, b->n);
	double altitude = a->altitude < b->altitude ? a->altitude : b->altitude,
	       shift = COINCIDE_TILT * (a->rounding + b->rounding);
	return vec3_dot(cross_product, cross_product) * altitude * altitude > shift * shift;
}

/* Whether triangle a overlaps b in its plane by more than touching neighbours do because of rounding. vertex_error:
 * that of their vertices in addition to the rounding of coordinates to float (struct placement). *covers_all: b covers
 * all of a. */
bool coincide_triangles(const struct triangle *a, const struct triangle *b, double vertex_error, bool *covers_all);

/* Whether two spheres are equal within the rounding of floats. */
bool coincide_spheres(const struct accel_shape *a, const struct accel_shape *b);

#endif
