/* SPDX-License-Identifier: Apache-2.0 */
/* Shapes in the rescaled world, points on them, and how these change: what surface.h computes. */
#ifndef WORKER_RENDER_GEOM_SURFACE_POINT_H
#define WORKER_RENDER_GEOM_SURFACE_POINT_H

#include "worker/render/geom/primitive.h"
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
	const struct curves *curves;   /* it is these, with normal_sign; NULL: it is none */
	bool culled;		       /* curves: no ray meets them from inside, where normals do not point */
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
	double b1, b2; /* barycentrics on a triangle; struct curve_site on a curve; 0 on a sphere */
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
			  and around a curve (except at their poles) */
};

#endif
