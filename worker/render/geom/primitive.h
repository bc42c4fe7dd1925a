/* SPDX-License-Identifier: Apache-2.0 */
/* Shapes as they are traced, their primitives, and the ends of rays on them. Lengths are those of the rescaled
 * world. */
#ifndef WORKER_RENDER_GEOM_PRIMITIVE_H
#define WORKER_RENDER_GEOM_PRIMITIVE_H

#include "worker/render/geom/placement.h"

#include <stdbool.h>
#include <stdint.h>

/* Ranks of surfaces. Where surfaces coincide, only the one of the lowest rank is present. */
enum surface_rank {
	SURFACE_EMITS,
	SURFACE_OPAQUE,
	SURFACE_TRANSMITS,
	SURFACE_SEE_THROUGH, /* transmits light straight through: null, mask */
	SURFACE_RANKS
};

struct accel_shape {
	bool is_sphere;
	vec3 center; /* for spheres */
	double radius;
	/* For triangle meshes. The arrays must outlive the accel and be readable up to 16 bytes from the
	 * start of the last vertex. */
	uint32_t vertex_count, triangle_count;
	const float (*position)[3];
	const uint32_t (*index)[3];
	enum surface_rank rank;
	/* The placement of this instance of a mesh, or the movement of a sphere; NULL: positions are in world space. */
	const struct placement *placement;
	/* Vertices in double, for a shape too large for floats relative to small ones; NULL: `position` is exact. */
	const double (*unrounded)[3];
	/* The shape consists of these curves and has no triangles; NULL: it has no curves. */
	const struct curves *curves;
	bool culls_backfaces; /* for curves: rays do not meet them from inside */
};

/* Returns the triangle `prim` at a time: see struct prim_ref. */
static inline struct triangle accel_triangle(const struct accel_shape *s, uint32_t prim, double time)
{
	const uint32_t *i = s->index[prim];
	struct placement storage;
	if (s->unrounded)
		return triangle_unrounded(s->unrounded, i);
	return s->placement ? placement_triangle(placement_at(s->placement, time, &storage), s->position, i)
			    : triangle_from(s->position, i);
}

/* Whether the shape is an instance of a mesh. A sphere with a placement is not; it moves. */
static inline bool accel_is_instance(const struct accel_shape *s)
{
	return s->placement && !s->is_sphere;
}

static inline bool accel_shape_is_moving(const struct accel_shape *s)
{
	return s->placement && s->placement->movement;
}

/* A primitive and a time: 0 when the shutter opens, 1 when it closes. The time only matters for shapes that move.
 * Everything that belongs to one path has the same time. */
struct prim_ref {
	uint32_t shape, prim;
	double time;
};
#define PRIM_NONE ((struct prim_ref){UINT32_MAX, UINT32_MAX, 0})

/* A reference to no primitive, with a time. */
static inline struct prim_ref prim_none_at(double time)
{
	return (struct prim_ref){UINT32_MAX, UINT32_MAX, time};
}

/* An end of a ray or segment: position, primitive, and the unit geometric normal there (0: not on a surface). */
struct ray_end {
	vec3 p, ng;
	struct prim_ref prim;
};

struct ray_hit {
	struct prim_ref prim;
	double t; /* approximate distance */
	/* Embree's barycentrics, used for rays that lie in the triangle's plane; for curves, the part and the root. */
	double u, v;
};

#endif
