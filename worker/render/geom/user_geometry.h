/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Primitives that our own callbacks intersect in double: spheres, curves, and triangles too large for floats relative
 * to small things in a scene of mixed scales. Runs inside Embree's traversal: any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_GEOM_USER_GEOMETRY_H
#define WORKER_RENDER_GEOM_USER_GEOMETRY_H

#include "worker/render/geom/coincide.h"
#include "worker/render/geom/curves.h"
#include "worker/render/geom/embree.h"

/* The state that a query passes to Embree's callbacks. */
struct ray_query {
	embree_context context;
	/* The ray in double, which decides whether Embree's proposals are hits; end: o + d for a segment. */
	vec3 o, d, end;
	bool is_segment;
	double t_min;
	double float_error; /* error bound of Embree's floats along this ray */
	/* Times float_error: the length of the ray within reach of the surface at its start, and at its end
	 * (query_grazing_factor). */
	double start_grazing, end_grazing;
	double part_lead;   /* distance by which Embree's ray starts earlier than this part of the ray, in units of d */
	double origin_lead; /* Embree's ray starts this far before o, in units of d; negative: after it */
	/* Triangles of at least this extent are intersected in double; INFINITY: none. */
	double min_wide_extent;
	struct prim_ref start_prim, end_prim;
	/* The surfaces on which o and end are; NULL: none, or they are far from o. */
	const struct ray_end *start_surface, *end_surface;
	const struct coincidence *coincidence; /* NULL: no surfaces coincide */
	const struct accel_shape *shapes;
	/* Distance of the closest hit on a curve, in double; valid while Embree's tfar is nearest_tfar. */
	double nearest_t;
	float nearest_tfar;
};

struct sphere_prim {
	vec3 center;
	double radius;
	const struct placement *placement; /* its movement; NULL: it does not move */
	uint32_t shape;
};

/* The triangles of a shape that are intersected in double, in a scene of mixed scales. */
struct wide_prims {
	const struct accel_shape *shape;
	uint32_t shape_id, count;
	uint32_t *prims;
};

struct curve_prims {
	const struct curves *curves;
	bool culls_backfaces;
	uint32_t shape;
	/* A ray given to Embree may deviate from the true one by ray_error + ray_error_slope |p| at a point p. */
	double ray_error, ray_error_slope;
};

/* Whether the ray crosses the plane of a triangle after its start and, for a segment, before its end. A ray that starts
 * in the plane, on a coplanar neighbour, does not cross it again. */
bool query_crosses(const struct ray_query *q, const struct accel_shape *s, uint32_t prim);

/* Returns, for a ray along d from a surface with normal n that is lifted off the surface by some distance, the length
 * along d by which it returns to the surface, divided by that distance. A lifted ray that starts this much earlier
 * misses nothing closer to the surface than its lift; if it started behind the surface, it would hit neighbours whose
 * planes the true ray crosses elsewhere. Limited to between 1 and 64; 1 if n is 0. */
double query_grazing_factor(vec3 n, vec3 d);

/* Whether the ray starts or ends on the primitive p. */
static inline bool query_is_end(const struct ray_query *q, struct prim_ref p)
{
	return (p.shape == q->start_prim.shape && p.prim == q->start_prim.prim) ||
	       (p.shape == q->end_prim.shape && p.prim == q->end_prim.prim);
}

/* Returns the triangle that is present where the ray crosses the plane of `prim`: `prim` itself, or the one
 * that hides it (coincide.h). */
struct prim_ref query_present_prim(const struct ray_query *q, struct prim_ref prim);
/* Whether some primitive of this shape is hidden by another one. */
static inline bool query_may_be_hidden(const struct ray_query *q, uint32_t shape)
{
	return q->coincidence && q->coincidence->first_pair[shape] < q->coincidence->first_pair[shape + 1];
}
/* Like query_crosses(), but for the primitive that is present there; false if an end of the ray is on that
 * primitive. */
bool query_crosses_present(const struct ray_query *q, struct prim_ref prim);

/* Callbacks; their user data, which must outlive the geometry, is a struct sphere_prim, wide_prims or curve_prims. */
extern const struct embree_ops user_sphere_ops, user_triangle_ops, user_curve_ops;

#endif
