/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Surfaces that coincide: triangles that overlap in one plane as far as float vertices can tell, and equal spheres
 * (curves are not compared, which no scene is known to have twice). It
 * would be chance which of them a ray hits, and sampling a point on one of them would not ask. So one rule applies to
 * everything: where several coincide, only the one of the lowest rank is present; of equals, the first. The others are
 * hidden there.
 *
 * Found once, before Embree's tree is built: small meshes and triangles are sorted into smaller and smaller boxes, as
 * long as a box holds more than one shape or an emitter (points on emitters are sampled by area, so a duplicate
 * triangle would count twice). Triangles of one shape that does not emit are left alone: it does not matter which of
 * them is hit. Work and memory are bounded in proportion to the number of triangles; if that is not enough, what was
 * found applies and `incomplete` is set.
 *
 * The result is immutable: any thread. Finding allocates and ticks (common/base/liveness.h); queries do not.
 */
#ifndef WORKER_RENDER_GEOM_COINCIDE_H
#define WORKER_RENDER_GEOM_COINCIDE_H

#include "worker/render/geom/primitive.h"
#include "worker/render/geom/triangle.h"

#include <stddef.h>
#include "common/base/error.h"

/* A primitive that is hidden, in part or entirely, by another one within the rounding of vertices. */
struct coincide_pair {
	struct prim_ref hidden, by;
	enum surface_rank rank; /* of `by` */
	bool wholly;
	bool same_side; /* their normals have the same direction */
};

/* Two shapes with coinciding primitives. */
struct coincide_shapes {
	uint32_t hidden, by;
	bool same_side; /* some of them with normals in the same direction */
};

struct coincidence {
	size_t pair_count, shapes_count;
	struct coincide_pair *pairs;	/* sorted by hidden shape, hidden primitive, then by the rank of `by` */
	struct coincide_shapes *shapes; /* each pair once, in the same order */
	size_t *first;			/* one per shape, plus one: where its pairs begin */
	bool incomplete;
};

void coincide_free(struct coincidence *c);

/* Which primitive is present at the point p of this one: itself, or what hides it. c may be NULL. */
struct prim_ref coincide_there(const struct coincidence *c, const struct accel_shape *shapes, struct prim_ref prim,
			       vec3 p);

/* The sine of the angle between coinciding triangles is at most this many times what rounding moves their vertices by,
 * relative to the smaller altitude of the two: as if both ends of either were off to opposite sides, twice. Planes that
 * differ by more cross. */
#define COINCIDE_TILT 4.0

/* How a triangle faces. */
struct coincide_facing {
	vec3 n; /* of unit length; 0: unknown */
	double altitude, rounded;
};

struct coincide_facing coincide_facing_of(const struct triangle *t);

/* Whether two triangles differ in direction by so much that coincide_triangles is false, if neither has errors besides
 * rounding. Quick. */
static inline bool coincide_faces_away(const struct coincide_facing *a, const struct coincide_facing *b)
{
	vec3 across = vec3_cross(a->n, b->n);
	double low = a->altitude < b->altitude ? a->altitude : b->altitude,
	       off = COINCIDE_TILT * (a->rounded + b->rounded);
	return vec3_dot(across, across) * low * low > off * off;
}

/* Whether triangle a overlaps b in its plane by more than rounding makes touching neighbours overlap. off: the error
 * of their vertices besides the rounding of coordinates to float (struct placement). */
bool coincide_triangles(const struct triangle *a, const struct triangle *b, double off, bool *wholly);

/* Whether two spheres are one within the rounding of floats. */
bool coincide_spheres(const struct accel_shape *a, const struct accel_shape *b);

#endif
