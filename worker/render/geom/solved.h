/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Primitives that Embree asks us about, solved in double: spheres, and triangles too large for floats beside what is
 * small in a scene of mixed scales. Runs inside Embree's traversal: any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_GEOM_SOLVED_H
#define WORKER_RENDER_GEOM_SOLVED_H

#include "worker/render/geom/coincide.h"
#include "worker/render/geom/embree.h"

/* What a query carries into Embree's callbacks. */
struct query {
	embree_context context;
	vec3 o, d, end; /* in double: what Embree proposes is judged by these; end: o + d for a segment */
	bool segment;
	double t_min;
	double reach;	    /* how far Embree's floats can be off along this ray */
	double low, beyond; /* reach times these: along the ray to the height of it, over where it starts and ends */
	double before;	    /* by how much Embree's ray begins early, in units of d */
	double back;	    /* Embree's ray begins that much before o, in units of d; below 0: after it */
	double wide_from;   /* extent from which on triangles are solved in double; INFINITY: none is */
	struct prim_ref from, to;
	const struct ray_end *start, *finish;  /* the surfaces on which o and end lie; NULL: free, or far from o */
	const struct coincidence *coincidence; /* NULL: no surfaces coincide */
	const struct accel_shape *shapes;
};

struct sphere_prim {
	vec3 center;
	double radius;
	uint32_t shape;
};

/* The triangles of a shape that are solved in double, in scenes of mixed scales. */
struct wide_prims {
	const struct accel_shape *shape;
	uint32_t id, count;
	uint32_t *prim;
};

/* The plane of a triangle is crossed after the start, and before the end of a segment. A ray that starts in the plane,
 * on a coplanar neighbour, does not cross it again. */
bool query_crosses(const struct query *q, const struct accel_shape *s, uint32_t prim);

/* How far along d, for a step away from the surface of normal n: a ray that is lifted comes back to the surface that
 * much earlier. Begun there, it loses nothing that is nearer to the surface than it is lifted; begun behind the
 * surface, it would meet neighbours whose planes the true ray crosses elsewhere. 1 where n is 0. */
double query_lowness(vec3 n, vec3 d);

/* The ray starts or ends on it. */
static inline bool query_is_end(const struct query *q, struct prim_ref p)
{
	return (p.shape == q->from.shape && p.prim == q->from.prim) || (p.shape == q->to.shape && p.prim == q->to.prim);
}

/* Which triangle is there where the ray crosses the plane of this one: it, or what hides it (coincide.h). */
struct prim_ref query_there(const struct query *q, struct prim_ref prim);
/* Some of this shape is hidden. */
static inline bool query_hides(const struct query *q, uint32_t shape)
{
	return q->coincidence && q->coincidence->first[shape] < q->coincidence->first[shape + 1];
}
/* The same as query_crosses, of what is there; no end of the ray lies on that. */
bool query_crosses_there(const struct query *q, struct prim_ref prim);

/* What a user geometry is made of; both outlive it. */
void solved_sphere(RTCGeometry g, struct sphere_prim *s);
void solved_triangles(RTCGeometry g, struct wide_prims *w);

#endif
