/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Where one instance of a mesh is. The mesh has float vertices in a frame of its own, in which it fits into the unit
 * sphere; the instance's vertices are these in double, transformed into the world whenever they are read. So everything
 * decided by planes and computed in double happens in the world, and two triangles that share a vertex share it there,
 * to the bit. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_PLACEMENT_H
#define WORKER_RENDER_GEOM_PLACEMENT_H

#include "worker/render/geom/triangle.h"
#include "worker/render/math/motion.h"

/* How an instance moves: from the mesh's frame, in which this is its bounding box, to the world. */
struct movement {
	struct motion motion;
	vec3 low, high;
};

struct placement {
	vec3 x, y, z, at;	      /* columns: p in the world is x p.x + y p.y + z p.z + at */
	vec3 back[3];		      /* rows of the inverse of x, y, z */
	vec3 center, half;	      /* the bounding box, in the world */
	double rounding;	      /* rounding error of world coordinates, in the mesh's frame */
	double vertex_is_off;	      /* error of rounding to float in the mesh's frame, in the world */
	uint32_t first;		      /* the first shape that is an instance of the same mesh */
	bool mirrored;		      /* its triangles are wound opposite to the mesh's frame */
	const struct movement *moves; /* NULL: it is still. Otherwise this is where it is when the shutter opens, except
					 that center, half and vertex_is_off hold for all times */
};

/* m: affine, from the mesh's frame, in which this is its bounding box, to the world. false: it has no inverse, or is
 * so uneven that lengths differ by more than 2^16, or so small relative to the world (2^-80) that products of its
 * lengths would underflow. */
bool placement_make(struct placement *p, const mat4 *m, vec3 low, vec3 high);

/* The same for an instance that moves; m must outlive it. */
bool placement_make_moving(struct placement *p, const struct movement *m);
void placement_move(const struct placement *p, double time, struct placement *out);

/* Where it is at that time; room: for one that moves. */
static inline const struct placement *placement_at(const struct placement *p, double time, struct placement *room)
{
	if (!p->moves)
		return p;
	placement_move(p, time, room);
	return room;
}

/* Whether lengths differ by no more than that. */
bool placement_is_even(const mat4 *m);

static inline vec3 placement_vector(const struct placement *m, vec3 v)
{
	return vec3_madd(vec3_madd(vec3_scale(v.x, m->x), v.y, m->y), v.z, m->z);
}

static inline vec3 placement_point(const struct placement *m, vec3 p)
{
	return vec3_add(placement_vector(m, p), m->at);
}

/* Unit. */
static inline vec3 placement_normal(const struct placement *m, vec3 n)
{
	return vec3_normalize(vec3_madd(vec3_madd(vec3_scale(n.x, m->back[0]), n.y, m->back[1]), n.z, m->back[2]));
}

static inline vec3 placement_vector_back(const struct placement *m, vec3 v)
{
	return (vec3){vec3_dot(m->back[0], v), vec3_dot(m->back[1], v), vec3_dot(m->back[2], v)};
}

static inline vec3 placement_point_back(const struct placement *m, vec3 p)
{
	return placement_vector_back(m, vec3_sub(p, m->at));
}

/* Not normalised. */
static inline vec3 placement_normal_back(const struct placement *m, vec3 n)
{
	return (vec3){vec3_dot(m->x, n), vec3_dot(m->y, n), vec3_dot(m->z, n)};
}

/* Edges are computed from the mesh's own, so that they keep their precision however far away it is. */
static inline struct triangle placement_triangle(const struct placement *m, const float (*position)[3],
						 const uint32_t i[3])
{
	vec3 p0 = triangle_vertex(position, i[0]), p1 = triangle_vertex(position, i[1]),
	     p2 = triangle_vertex(position, i[2]);
	return triangle_between(placement_point(m, p0), placement_point(m, p1), placement_point(m, p2),
				placement_vector(m, vec3_sub(p1, p0)), placement_vector(m, vec3_sub(p2, p0)));
}

#endif
