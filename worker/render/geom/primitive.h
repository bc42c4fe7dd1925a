/* SPDX-License-Identifier: Apache-2.0 */
/* Shapes as they are traced, their primitives, and ends of rays on them. Lengths are those of the rescaled world. */
#ifndef WORKER_RENDER_GEOM_PRIMITIVE_H
#define WORKER_RENDER_GEOM_PRIMITIVE_H

#include "worker/render/geom/placement.h"

#include <stdbool.h>
#include <stdint.h>

/* Of coinciding surfaces, the one of the lowest rank is present. */
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
	const struct placement *place; /* where this instance of a mesh is; NULL: positions are in world space */
	const double (*unrounded)[3];  /* vertices in double, for a shape too large for floats relative to small ones;
					  NULL: position */
};

static inline struct triangle accel_triangle(const struct accel_shape *s, uint32_t prim)
{
	const uint32_t *i = s->index[prim];
	if (s->unrounded)
		return triangle_unrounded(s->unrounded, i);
	return s->place ? placement_triangle(s->place, s->position, i) : triangle_from(s->position, i);
}

struct prim_ref {
	uint32_t shape, prim;
};
#define PRIM_NONE ((struct prim_ref){UINT32_MAX, UINT32_MAX})

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
