/* SPDX-License-Identifier: Apache-2.0 */
/* Shapes as they are traced, their primitives, and ends of rays on them. Lengths are those of the rescaled world. */
#ifndef WORKER_RENDER_GEOM_PRIMITIVE_H
#define WORKER_RENDER_GEOM_PRIMITIVE_H

#include "worker/render/geom/placement.h"

#include <stdbool.h>
#include <stdint.h>

/* Where surfaces coincide, only the one of the lowest rank is present. */
enum surface_rank {
	SURFACE_SHINES,
	SURFACE_OPAQUE,
	SURFACE_TRANSMITS,
	SURFACE_PASSES, /* transmits straight through: null, mask */
	SURFACE_RANKS
};

struct accel_shape {
	bool is_sphere;
	vec3 center; /* sphere */
	double radius;
	uint32_t vertex_count, triangle_count; /* otherwise triangles; the arrays must outlive the accel and be readable
						  up to 16 bytes from the start of the last vertex */
	const float (*position)[3];
	const uint32_t (*index)[3];
	enum surface_rank rank;
	const struct placement *place; /* where this instance of a mesh is, or how a sphere moves; NULL: positions are
					  in world space */
	const double (*unrounded)[3];  /* vertices in double, for a shape too large for floats relative to small ones;
					  NULL: position */
	const struct curves *curves;   /* it is these, without triangles; NULL: it is none */
	bool culled;		       /* curves: no ray meets them from inside */
};

/* The triangle `prim`; time: see struct prim_ref. */
static inline struct triangle accel_triangle(const struct accel_shape *s, uint32_t prim, double time)
{
	const uint32_t *i = s->index[prim];
	struct placement room;
	if (s->unrounded)
		return triangle_unrounded(s->unrounded, i);
	return s->place ? placement_triangle(placement_at(s->place, time, &room), s->position, i)
			: triangle_from(s->position, i);
}

/* Whether it is an instance of a mesh. A sphere with a placement moves. */
static inline bool accel_is_instance(const struct accel_shape *s)
{
	return s->place && !s->is_sphere;
}

static inline bool accel_moves(const struct accel_shape *s)
{
	return s->place && s->place->moves;
}

/* A primitive at a time: 0 where the shutter opens, 1 where it closes. The time matters for what moves; everything that
 * belongs to one path has the same. */
struct prim_ref {
	uint32_t shape, prim;
	double time;
};
#define PRIM_NONE ((struct prim_ref){UINT32_MAX, UINT32_MAX, 0})

/* On no primitive, at that time. */
static inline struct prim_ref prim_none_at(double time)
{
	return (struct prim_ref){UINT32_MAX, UINT32_MAX, time};
}

/* An end of a ray or segment: position, primitive, and unit geometric normal there (0: not on a surface). */
struct ray_end {
	vec3 p, ng;
	struct prim_ref prim;
};

struct ray_hit {
	struct prim_ref prim;
	double t;    /* approximately */
	double u, v; /* Embree's barycentrics, for rays in the triangle's plane */
};

#endif
