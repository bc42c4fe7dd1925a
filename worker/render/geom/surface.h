/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Points on primitives, in double. The position is computed from the primitive itself: on triangles in the plane of
 * their vertices, which are floats, doubles transformed from floats for instances, or doubles for large triangles in
 * scenes of mixed scales; on spheres and curves analytically. A point also has the geometric normal, the interpolated
 * shading frame (bent by relief) and texture coordinates. The geometric normal follows the winding; the world winds
 * triangles such that it agrees with the vertex normals. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_SURFACE_H
#define WORKER_RENDER_GEOM_SURFACE_H

#include "worker/render/geom/accel.h"
#include "worker/render/geom/surface_point.h"

/* Computes the point of a primitive nearest to p, which should be on it. Its precision is relative to the size of the
 * primitive, wherever the primitive is. Returns false if there is no such point. */
bool surface_nearest(const struct geom_shape *s, struct prim_ref prim, vec3 p, struct surface_point *x);
/* Computes the point where the ray o + t d hits the primitive named by `hit`. */
void surface_from_hit(const struct geom_shape *s, vec3 o, vec3 d, const struct ray_hit *hit, struct surface_point *x);
/* Compute the point with barycentrics (b1, b2) on a triangle, and the point in the unit direction
 * w from a sphere's centre. */
void surface_on_triangle(const struct geom_shape *s, struct prim_ref prim, double b1, double b2,
			 struct surface_point *x);
void surface_on_sphere(const struct geom_shape *s, struct prim_ref prim, vec3 w, struct surface_point *x);
/* Computes the point with these coordinates (curves.h) on a curve. Returns false if the primitive has no such point. */
bool surface_on_curve(const struct geom_shape *s, struct prim_ref prim, double along, double around,
		      struct surface_point *x);
/* Computes the point where the ray from o (on the primitive `from`) along the unit direction d hits this one
 * primitive, regardless of anything between; if it crosses a sphere or a curve several times, the crossing nearest to
 * t_near. Returns false if it misses. The u and v of a sphere without relief are left for surface_uv, because they
 * cost as much as everything else. */
bool surface_reproject(const struct geom_shape *s, struct prim_ref prim, struct prim_ref from, vec3 o, vec3 d,
		       double t_near, struct surface_point *x);

/* Returns the shading frame that the surface_point would have with another relief (NULL for none), expressed in its
 * present shading frame: as in struct relief_frames. */
struct frame surface_frame_with_relief(const void *surface_point, const struct relief *r);

/* Mirrors a shading normal n bent by relief at the unbent normal n0: n' = 2 (n.n0) n0 - n. */
void surface_flip_relief(struct surface_point *x);

void surface_uv(const struct geom_shape *s, struct surface_point *x);

/* Computes only du and dv of struct surface_derivatives. */
void surface_tangents(const struct surface_point *x, vec3 *du, vec3 *dv);
/* Computes how x changes as it moves; all results are finite. */
void surface_compute_derivatives(const struct geom_shape *s, const struct surface_point *x,
				 struct surface_derivatives *c);

#endif
