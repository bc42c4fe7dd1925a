/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A point on a primitive, in double: the position computed from the primitive itself (triangles in the plane of their
 * vertices, which are floats; doubles transformed from floats for instances; doubles for large triangles in scenes of
 * mixed scales; spheres and curves analytically), geometric normal, interpolated shading frame (bent by relief),
 * texture coordinates. The geometric normal follows the winding; the world winds triangles such that it agrees with the
 * vertex normals. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_SURFACE_H
#define WORKER_RENDER_GEOM_SURFACE_H

#include "worker/render/geom/accel.h"
#include "worker/render/geom/surface_point.h"

/* The point of a primitive nearest to p, which should be on it: as exact as the primitive is small, wherever it is. */
bool surface_near(const struct geom_shape *s, struct prim_ref prim, vec3 p, struct surface_point *x);
/* Where the ray o + t d hits the primitive named by the hit. */
void surface_from_hit(const struct geom_shape *s, vec3 o, vec3 d, const struct ray_hit *hit, struct surface_point *x);
/* The point with barycentrics (b1, b2) on a triangle, or in unit normal direction w from a sphere's centre. */
void surface_on_triangle(const struct geom_shape *s, struct prim_ref prim, double b1, double b2,
			 struct surface_point *x);
void surface_on_sphere(const struct geom_shape *s, struct prim_ref prim, vec3 w, struct surface_point *x);
/* false: the primitive of the curves has no such point. */
bool surface_on_curve(const struct geom_shape *s, struct prim_ref prim, double along, double around,
		      struct surface_point *x);
/* Where the ray from o (which is on the primitive `from`) along the unit direction d hits this one primitive,
 * whatever lies between; of the crossings with a sphere or a curve the one nearest to t_near. false: it misses. The u
 * and v of a sphere without relief, which cost as much as everything else, are left for surface_uv. */
bool surface_reproject(const struct geom_shape *s, struct prim_ref prim, struct prim_ref from, vec3 o, vec3 d,
		       double t_near, struct surface_point *x);

/* The frame that the surface_point would have with another relief, NULL for none: as in struct relief_place. */
struct frame surface_frame_with(const void *surface_point, const struct relief *r);

/* Turns a shading normal bent by relief to the other side of the one without: n' = 2 (n.n0) n0 - n. */
void surface_turn_relief(struct surface_point *x);

void surface_uv(const struct geom_shape *s, struct surface_point *x);

/* Only du and dv of struct surface_change. */
void surface_tangents(const struct surface_point *x, vec3 *du, vec3 *dv);
/* Finite whatever x is. */
void surface_change_of(const struct geom_shape *s, const struct surface_point *x, struct surface_change *c);

#endif
