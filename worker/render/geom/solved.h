/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Primitives that our own callbacks intersect in double: spheres, curves, and triangles too large for floats relative
 * to small things in a scene of mixed scales. Runs inside Embree's traversal: any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_GEOM_SOLVED_H
#define WORKER_RENDER_GEOM_SOLVED_H

#include "worker/render/geom/coincide.h"
#include "worker/render/geom/curves.h"
#include "worker/render/geom/embree.h"

/* The state that a query passes to Embree's callbacks. */
struct query {
	embree_context context;
	/* The ray in double, which decides whether Embree's proposals are hits; end: o + d for a segment. */
	vec3 o, d, end;
	bool segment;
	double t_min;
	double reach; /* error bound of Embree's floats along this ray */
	/* Times reach: the length of the ray within reach of the surface at its start, and at its end
	 * (query_lowness). */
	double low, beyond;
	double before; /* distance by which Embree's ray starts earlier than this part of the ray, in units of d */
	double back;   /* Embree's ray starts this far before o, in units of d; negative: after it */
	/* Triangles of at least this extent are intersected in double; INFINITY: none. */
	double wide_from;
	struct prim_ref from, to;
	/* The surfaces on which o and end are; NULL: none, or they are far from o. */
	const struct ray_end *start, *finish;
	const struct coincidence *coincidence; /* NULL: no surfaces coincide */
	const struct accel_shape *shapes;
	/* Distance of the closest hit on a curve, in double; valid while Embree's tfar is nearest_far. */
	double nearest;
	float nearest_far;
};

struct sphere_prim {
	vec3 center;
	double radius;
	const struct placement *place; /* its movement; NULL: it does not move */
	uint32_t shape;
};

/* The triangles of a shape that are intersected in double, in a scene of mixed scales. */
struct wide_prims {
	const struct accel_shape *shape;
	uint32_t id, count;
	uint32_t *prim;
};

struct curve_prims {
	const struct curves *curves;
	bool culled;
	uint32_t shape;
	/* A ray given to Embree may deviate from the true one by off + off_far |p| at a point p. */
	double off, off_far;
};

/* Whether the ray crosses the plane of a triangle after its start and, for a segment, before its end. A ray that starts
 * in the plane, on a coplanar neighbour, does not cross it again. */
bool query_crosses(const struct query *q, const struct accel_shape *s, uint32_t prim);

/* Returns, for a ray along d from a surface with normal n that is lifted off the surface by some distance, the length
 * along d by which it returns to the surface, divided by that distance. A lifted ray that starts this much earlier
 * misses nothing closer to the surface than its lift; if it started behind the surface, it would hit neighbours whose
 * planes the true ray crosses elsewhere. Limited to between 1 and 64; 1 if n is 0. */
double query_lowness(vec3 n, vec3 d);

/* Whether the ray starts or ends on the primitive p. */
static inline bool query_is_end(const struct query *q, struct prim_ref p)
{
	return (p.shape == q->from.shape && p.prim == q->from.prim) || (p.shape == q->to.shape && p.prim == q->to.prim);
}

/* Returns the triangle that is present where the ray crosses the plane of `prim`: `prim` itself, or the one
 * that hides it (coincide.h). */
struct prim_ref query_there(const struct query *q, struct prim_ref prim);
/* Whether some primitive of this shape is hidden by another one. */
static inline bool query_hides(const struct query *q, uint32_t shape)
{
	return q->coincidence && q->coincidence->first[shape] < q->coincidence->first[shape + 1];
}
/* Like query_crosses(), but for the primitive that is present there; false if an end of the ray is on that
 * primitive. */
bool query_crosses_there(const struct query *q, struct prim_ref prim);

/* Callbacks; their user data, which must outlive the geometry, is a struct sphere_prim, wide_prims or curve_prims. */
extern const struct embree_ops solved_sphere, solved_triangles, solved_curves;

#endif
