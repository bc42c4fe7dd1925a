/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The placement of one instance of a mesh. The mesh has float vertices in a frame of its own, in which it fits into the
 * unit sphere; the instance's vertices are these in double, transformed to world space whenever they are read. So every
 * decision about planes and every computation in double happens in world space, and two triangles that share a vertex
 * share it there to the bit. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_PLACEMENT_H
#define WORKER_RENDER_GEOM_PLACEMENT_H

#include "worker/render/geom/triangle.h"
#include "worker/render/math/motion.h"

/* The movement of an instance from the mesh's frame, in which its bounding box is given, to the world. */
struct swept_motion {
	struct motion motion;
	vec3 box_min, box_max;
};

struct placement {
	vec3 x, y, z, origin; /* matrix columns: p maps to x p.x + y p.y + z p.z + origin in world space */
	vec3 inverse_rows[3]; /* rows of the inverse of the matrix x, y, z */
	vec3 center, half;    /* bounding box in world space */
	/* Rounding error of world coordinates, expressed in the mesh's frame. */
	double rounding;
	/* Error of rounding vertices to float in the mesh's frame, expressed in world space. */
	double vertex_error;
	uint32_t first_shape; /* index of the first shape that is an instance of the same mesh */
	bool is_mirrored;     /* its triangles are wound in the opposite sense to those in the mesh's frame */
	/* NULL: the instance does not move. Otherwise this is its placement when the shutter opens, except that center,
	 * half and vertex_error hold for all times. */
	const struct swept_motion *movement;
};

/* Makes a placement from an affine map m from the mesh's frame, in which low and high bound it, to the world. Returns
 * false if m has no inverse, is so uneven that its scales in different directions differ by more than 2^16, or is so
 * small relative to the world (2^-80) that products of lengths would underflow. */
bool placement_make(struct placement *p, const mat4 *m, vec3 low, vec3 high);

/* placement_make_moving is like placement_make(), but for an instance that moves; m must outlive the placement.
 * placement_compute_at returns the placement at a time. */
bool placement_make_moving(struct placement *p, const struct swept_motion *m);
void placement_compute_at(const struct placement *p, double time, struct placement *out);

/* Returns the placement at a time; `storage` is used if the instance moves. */
static inline const struct placement *placement_at(const struct placement *p, double time, struct placement *storage)
{
	if (!p->movement)
		return p;
	placement_compute_at(p, time, storage);
	return storage;
}

/* Whether the scales of m in different directions differ by no more than the limit of placement_make(). */
bool placement_is_even(const mat4 *m);

static inline vec3 placement_vector(const struct placement *m, vec3 v)
{
	return vec3_madd(vec3_madd(vec3_scale(v.x, m->x), v.y, m->y), v.z, m->z);
}

static inline vec3 placement_point(const struct placement *m, vec3 p)
{
	return vec3_add(placement_vector(m, p), m->origin);
}

/* Transforms a normal to world space and normalises it. */
static inline vec3 placement_normal(const struct placement *m, vec3 n)
{
	return vec3_normalize(vec3_madd(vec3_madd(vec3_scale(n.x, m->inverse_rows[0]), n.y, m->inverse_rows[1]), n.z,
					m->inverse_rows[2]));
}

static inline vec3 placement_vector_to_mesh(const struct placement *m, vec3 v)
{
	return (vec3){vec3_dot(m->inverse_rows[0], v), vec3_dot(m->inverse_rows[1], v),
		      vec3_dot(m->inverse_rows[2], v)};
}

static inline vec3 placement_point_to_mesh(const struct placement *m, vec3 p)
{
	return placement_vector_to_mesh(m, vec3_sub(p, m->origin));
}

/* Transforms a normal to the mesh's frame without normalising it. */
static inline vec3 placement_normal_to_mesh(const struct placement *m, vec3 n)
{
	return (vec3){vec3_dot(m->x, n), vec3_dot(m->y, n), vec3_dot(m->z, n)};
}

/* Edges are computed from those in the mesh's frame, so that they keep their precision however
 * far away the instance is. */
static inline struct triangle placement_triangle(const struct placement *m, const float (*position)[3],
						 const uint32_t i[3])
{
	vec3 p0 = triangle_vertex(position, i[0]), p1 = triangle_vertex(position, i[1]),
	     p2 = triangle_vertex(position, i[2]);
	return triangle_between(placement_point(m, p0), placement_point(m, p1), placement_point(m, p2),
				placement_vector(m, vec3_sub(p1, p0)), placement_vector(m, vec3_sub(p2, p0)));
}

#endif
