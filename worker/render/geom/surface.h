/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A point on a primitive, in double: the position computed from the primitive itself (triangles in the plane of their
 * vertices, which are floats; doubles transformed from floats for instances; doubles for large triangles in scenes of
 * mixed scales; spheres analytically), geometric normal, interpolated shading frame (bent by relief), texture
 * coordinates. The geometric normal follows the winding; the world winds triangles such that it agrees with the vertex
 * normals. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_SURFACE_H
#define WORKER_RENDER_GEOM_SURFACE_H

#include "worker/render/geom/accel.h"
#include "worker/render/geom/relief.h"

/* A shape in the rescaled world. Rays hit the floats, unless there are doubles; everything else is derived from
 * them. Instances of a mesh share its arrays. */
struct geom_shape {
	bool is_sphere;
	vec3 center;
	double radius, normal_sign;
	struct frame sphere_axes; /* of the (u,v) parametrisation: n is the pole */
	uint32_t vertex_count, triangle_count;
	float (*position)[3];
	double (*unrounded)[3]; /* as in struct accel_shape */
	uint32_t (*index)[3];
	float (*normal)[3];	       /* NULL: flat */
	float (*uv)[2];		       /* NULL: barycentrics are used */
	float (*tangent)[3][3];	       /* unit, at each corner of each triangle, three times 0: it has none; NULL: dp/du
					  is used */
	const struct relief *relief;   /* bends shading normals; NULL: none */
	const struct placement *place; /* for instances, and spheres that move; NULL: positions and normals are in world
					  space */
	double unit;		       /* the scene's unit of length in world units: for relief */
};

static inline bool surface_moves(const struct geom_shape *s)
{
	return s->place && s->place->moves;
}

struct surface_point {
	vec3 p, ng;
	struct frame sh; /* sh.n is the shading normal, bent by relief */
	double u, v;
	double b1, b2; /* barycentrics on a triangle; 0 on a sphere */
	vec3 axis; /* along which the shading frame is laid (frame_along): the interpolated tangent, dp/du, or another
		  direction where there is none */
	struct prim_ref prim;
	const struct geom_shape *shape; /* of prim; NULL for a point that lies on none */
};

/* Derivatives of a point's frame as it moves, per unit length, [0] along du and [1] along dv. */
struct surface_change {
	vec3 du, dv;   /* orthonormal, in the plane of ng: frame_along(ng, axis) */
	vec3 dn[2];    /* of the shading normal; 0 on flat-shaded triangles */
	vec3 axis;     /* the unit axis */
	vec3 daxis[2]; /* of the unit axis: 0 on a triangle without tangents, turning with the meridians on a sphere
			  (except at its poles) */
};

/* The point of a primitive nearest to p, which should be on it: as exact as the primitive is small, wherever it is. */
bool surface_near(const struct geom_shape *s, struct prim_ref prim, vec3 p, struct surface_point *x);
/* Where the ray o + t d hits the primitive named by the hit. */
void surface_from_hit(const struct geom_shape *s, vec3 o, vec3 d, const struct ray_hit *hit, struct surface_point *x);
/* The point with barycentrics (b1, b2) on a triangle, or in unit normal direction w from a sphere's centre. */
void surface_on_triangle(const struct geom_shape *s, struct prim_ref prim, double b1, double b2,
			 struct surface_point *x);
void surface_on_sphere(const struct geom_shape *s, struct prim_ref prim, vec3 w, struct surface_point *x);
/* Where the ray from o (which is on the primitive `from`) along the unit direction d hits this one primitive,
 * whatever lies between; of a sphere's two crossings the one nearest to t_near. false: it misses. The u and v of a
 * sphere without relief, which cost as much as everything else, are left for surface_uv. */
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
