/* SPDX-License-Identifier: Apache-2.0 */
/* Shapes as they are traced, their primitives, and ends of rays on them. Lengths: the rescaled world. */
#ifndef WORKER_RENDER_GEOM_PRIMITIVE_H
#define WORKER_RENDER_GEOM_PRIMITIVE_H

#include "worker/render/geom/placement.h"

#include <stdbool.h>
#include <stdint.h>

/* Of surfaces that coincide the one of least rank is there. */
enum surface_rank {
	SURFACE_SHINES,
	SURFACE_OPAQUE,
	SURFACE_TRANSMITS,
	SURFACE_PASSES, /* lets light go straight on: null, mask */
	SURFACE_RANKS
};

struct accel_shape {
	bool is_sphere;
	vec3 center; /* sphere */
	double radius;
	uint32_t vertex_count, triangle_count; /* else triangles; arrays must outlive the accel, readable 16 bytes from
						  the start of the last vertex */
	const float (*position)[3];
	const uint32_t (*index)[3];
	enum surface_rank rank;
	const struct placement *place; /* where this instance of a mesh stands; NULL: positions are the world's */
	const double (*unrounded)[3];  /* the vertices in double, of a shape that is too large for floats beside what is
					  small; NULL: position */
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

/* An end of a ray or segment: where, on which primitive, and the unit geometric normal there (0: free in space). */
struct ray_end {
	vec3 p, ng;
	struct prim_ref prim;
};

struct ray_hit {
	struct prim_ref prim;
	double t;    /* about */
	double u, v; /* Embree's barycentrics, for rays that lie in the triangle's plane */
};

#endif
