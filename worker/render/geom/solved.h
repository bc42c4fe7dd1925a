/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Primitives that are intersected in double by our own callbacks: spheres, curves, and triangles too large for floats
 * relative to small things in a scene of mixed scales. Runs inside Embree's traversal: any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_GEOM_SOLVED_H
#define WORKER_RENDER_GEOM_SOLVED_H

#include "worker/render/geom/coincide.h"
#include "worker/render/geom/curves.h"
#include "worker/render/geom/embree.h"

/* What a query passes to Embree's callbacks. */
struct query {
	embree_context context;
	vec3 o, d, end; /* in double, decides about Embree's proposals; end: o + d for a segment */
	bool segment;
	double t_min;
	double reach;	    /* the error bound of Embree's floats along this ray */
	double low, beyond; /* reach times these: the part of the ray up to that height over the surfaces of its start
			       and end */
	double before;	    /* how much earlier Embree's ray starts, in units of d */
	double back;	    /* Embree's ray starts this much before o, in units of d; negative: after it */
	double wide_from;   /* extent from which triangles are intersected in double; INFINITY: none */
	struct prim_ref from, to;
	const struct ray_end *start, *finish;  /* the surfaces that o and end are on; NULL: none, or far from o */
	const struct coincidence *coincidence; /* NULL: no surfaces coincide */
	const struct accel_shape *shapes;
	double nearest; /* of a closest hit on a curve, in double, while Embree's tfar is nearest_far */
	float nearest_far;
};

struct sphere_prim {
	vec3 center;
	double radius;
	const struct placement *place; /* how it moves; NULL: it is still */
	uint32_t shape;
};

/* The triangles of a shape that are intersected in double, in scenes of mixed scales. */
struct wide_prims {
	const struct accel_shape *shape;
	uint32_t id, count;
	uint32_t *prim;
};

struct curve_prims {
	const struct curves *curves;
	bool culled;
	uint32_t shape;
	double off, off_far; /* a ray given to Embree may pass a point p at this distance from the true one: off +
				off_far |p| */
};

/* Whether the plane of a triangle is crossed after the start, and before the end of a segment. A ray that starts in
 * the plane, on a coplanar neighbour, does not cross it again. */
bool query_crosses(const struct query *q, const struct accel_shape *s, uint32_t prim);

/* The length along d per distance from a surface with normal n: a lifted ray returns to the surface that much
 * earlier. Starting there, it misses nothing closer to the surface than its lift; starting behind the surface, it
 * would hit neighbours whose planes the true ray crosses elsewhere. 1 if n is 0. */
double query_lowness(vec3 n, vec3 d);

/* Whether the ray starts or ends on it. */
static inline bool query_is_end(const struct query *q, struct prim_ref p)
{
	return (p.shape == q->from.shape && p.prim == q->from.prim) || (p.shape == q->to.shape && p.prim == q->to.prim);
}

/* Which triangle is present where the ray crosses the plane of this one: it, or what hides it (coincide.h). */
struct prim_ref query_there(const struct query *q, struct prim_ref prim);
/* Whether some of this shape is hidden. */
static inline bool query_hides(const struct query *q, uint32_t shape)
{
	return q->coincidence && q->coincidence->first[shape] < q->coincidence->first[shape + 1];
}
/* As query_crosses, for the primitive that is present; no end of the ray is on it. */
bool query_crosses_there(const struct query *q, struct prim_ref prim);

/* Their data, which must outlive the geometry: struct sphere_prim, wide_prims, curve_prims. */
extern const struct embree_ops solved_sphere, solved_triangles, solved_curves;

#endif
