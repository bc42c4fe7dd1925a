/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A point on a primitive, in double: positions solved from the primitive itself (triangles in the plane of their
 * vertices, which are floats, of an instance floats moved in double, of what is large in a scene of mixed scales
 * doubles; spheres analytically), geometric normal,
 * interpolated shading frame (bent by relief), texture coordinates. The geometric normal is by winding; the world winds
 * triangles so that it agrees with the vertex normals. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_SURFACE_H
#define WORKER_RENDER_GEOM_SURFACE_H

#include "worker/render/geom/accel.h"
#include "worker/render/geom/relief.h"

/* A shape in the rescaled world. Floats are what rays meet, unless there are doubles; everything else derives from
 * them. Instances of a mesh share its arrays. */
struct geom_shape {
	bool is_sphere;
	vec3 center;
	double radius, normal_sign;
	struct frame sphere_axes; /* of the (u,v) parametrisation: n is the pole */
	uint32_t vertex_count, triangle_count;
	float (*position)[3];
	double (*unrounded)[3]; /* as struct accel_shape has it */
	uint32_t (*index)[3];
	float (*normal)[3];	       /* NULL: flat */
	float (*uv)[2];		       /* NULL: barycentrics stand in */
	const struct relief *relief;   /* bends shading normals; NULL: nothing does */
	const struct placement *place; /* of an instance; NULL: positions and normals are the world's */
	double unit;		       /* of the scene's length, in the world's: for relief */
};

struct surface_point {
	vec3 p, ng;
	struct frame sh; /* sh.n is the shading normal, as relief bends it */
	double u, v;
	double b1, b2; /* barycentrics on a triangle; 0 on a sphere */
	vec3 dpdu;
	struct prim_ref prim;
};

/* How a point's frame changes as it moves, per unit length, [0] along du and [1] along dv. */
struct surface_change {
	vec3 du, dv; /* orthonormal, in the plane of ng, du along dpdu; what frame_along falls back to where there is no
			dpdu */
	vec3 dn[2];  /* of the shading normal; 0 where a triangle shades flat */
	vec3 ddu[2]; /* of the field of unit du: 0 on a triangle, turning with the meridians on a sphere (not at its
			poles) */
};

/* The point of a primitive nearest to p, which should lie on it: as exact as the primitive is small, wherever it lies.
 */
bool surface_near(const struct geom_shape *s, struct prim_ref prim, vec3 p, struct surface_point *x);
/* Where the ray o + t d meets the primitive named by the hit. */
void surface_from_hit(const struct geom_shape *s, vec3 o, vec3 d, const struct ray_hit *hit, struct surface_point *x);
/* The point of barycentrics (b1, b2) on a triangle, or at unit normal direction w from a sphere's centre. */
void surface_on_triangle(const struct geom_shape *s, struct prim_ref prim, double b1, double b2,
			 struct surface_point *x);
void surface_on_sphere(const struct geom_shape *s, struct prim_ref prim, vec3 w, struct surface_point *x);
/* Where the ray from o (which lies on the primitive `from`) along the unit direction d meets this one primitive,
 * whatever lies between; of a sphere's two crossings the one nearest to t_near. false: it passes by. The u and v of a
 * sphere without relief, which cost as much as all the rest, are left for surface_uv. */
bool surface_reproject(const struct geom_shape *s, struct prim_ref prim, struct prim_ref from, vec3 o, vec3 d,
		       double t_near, struct surface_point *x);

void surface_uv(const struct geom_shape *s, struct surface_point *x);

/* du and dv of struct surface_change alone. */
void surface_tangents(const struct surface_point *x, vec3 *du, vec3 *dv);
/* Finite whatever x is. */
void surface_change_of(const struct geom_shape *s, const struct surface_point *x, struct surface_change *c);

#endif
