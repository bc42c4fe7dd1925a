/* SPDX-License-Identifier: Apache-2.0 */
/* Shapes in the rescaled world, points on them, and how these points change as they move: the results of surface.h. */
#ifndef WORKER_RENDER_GEOM_SURFACE_POINT_H
#define WORKER_RENDER_GEOM_SURFACE_POINT_H

#include "worker/render/geom/primitive.h"
#include "worker/render/geom/relief.h"

/* A shape in the rescaled world. Rays hit the float positions, or the doubles if there are any; everything else is
 * derived from them. Instances of a mesh share its arrays. */
struct geom_shape {
	bool is_sphere;
	vec3 center;
	double radius, normal_sign;
	/* Axes of the (u,v) parametrisation: n is the pole. */
	struct frame sphere_axes;
	uint32_t vertex_count, triangle_count;
	float (*position)[3];
	double (*unrounded)[3]; /* see struct accel_shape */
	uint32_t (*index)[3];
	float (*normal)[3]; /* vertex normals; NULL: flat shading */
	float (*uv)[2];	    /* NULL: barycentrics are the texture coordinates */
	/* Unit tangents at each corner of each triangle, or 0 at all three corners of a triangle that has
	 * none; NULL: dp/du is used. */
	float (*tangent)[3][3];
	const struct relief *relief; /* bends shading normals; NULL: none */
	/* The shape consists of these curves, oriented by normal_sign; NULL: it has no curves. */
	const struct curves *curves;
	/* For curves: rays do not meet them from inside; normals point outwards. */
	bool culls_backfaces;
	/* For instances and for spheres that move; NULL: positions and normals are in world space. */
	const struct placement *placement;
	double unit; /* the scene's unit of length in world units, for relief */
};

static inline bool surface_is_moving(const struct geom_shape *s)
{
	return s->placement && s->placement->movement;
}

struct surface_point {
	vec3 p, ng;
	struct frame sh; /* sh.n is the shading normal, bent by relief */
	double u, v;
	/* Barycentrics on a triangle; the coordinates of struct curve_coordinates on a curve; 0 on a sphere. */
	double b1, b2;
	/* The direction along which the shading frame is aligned (frame_along): the interpolated tangent, dp/du, or a
	 * substitute where neither exists. */
	vec3 axis;
	struct prim_ref prim;
	const struct geom_shape *shape; /* the shape of prim; NULL for a point that is on no shape */
};

/* Derivatives of a point's frame as it moves, per unit length, [0] along du and [1] along dv. */
struct surface_derivatives {
	vec3 du, dv; /* orthonormal, in the plane perpendicular to ng: frame_along(ng, axis) */
	vec3 dn[2];  /* derivatives of the shading normal; 0 on flat-shaded triangles */
	vec3 axis;   /* unit vector */
	/* Derivatives of the unit axis: 0 on a triangle without tangents; on a sphere and around a curve it turns with
	 * the meridians (except at their poles). */
	vec3 daxis[2];
};

#endif
