/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The one door to Embree (3.13 or 4). Rays in double go in, primitives come out; where on the primitive the ray met it
 * is solved again in double by surface.h.
 *
 * Self-intersection: a ray names the primitive it starts on (and, for a segment, the one it ends on). A plane triangle
 * cannot be met again from itself, so it is filtered; on a sphere the root that is the start (or the end) is divided
 * out of the quadratic. Every other triangle that Embree proposes is asked in double whether its plane is crossed
 * between the ends: a coplanar neighbour is not, however low the ray. So the ray that Embree gets in float may run off
 * the true one by what rounding can do in a scene of that extent, never by an absolute length.
 *
 * In a scene whose smallest shape is less than 2^-11 of it that would be too much. There a ray runs off by what
 * rounding does where it is: floats are the finer the nearer to the origin (worker/render/world/origin.h puts what is
 * small there), a ray that comes from far is cut into parts that each begin nearer, and triangles that are large beside
 * the smallest shape are solved in double.
 *
 * Embree runs in robust mode with one build thread. It raises INVALID on ordinary rays: what it raises is wiped away.
 * Immutable after creation: any thread. Lengths: the rescaled world, whose radius is about 1.
 */
#ifndef WORKER_RENDER_GEOM_ACCEL_H
#define WORKER_RENDER_GEOM_ACCEL_H

#include "common/base/error.h"
#include "worker/render/geom/placement.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct accel;
struct coincidence; /* coincide.h */

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
};

static inline struct triangle accel_triangle(const struct accel_shape *s, uint32_t prim)
{
	const uint32_t *i = s->index[prim];
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

/* c: what coincide_find found among the shapes; NULL: nothing. It outlives the accel. */
int accel_new(struct accel **a, const struct accel_shape *shapes, uint32_t count, const struct coincidence *c,
	      struct error *e);
void accel_free(struct accel *a);
size_t accel_bytes(const struct accel *a);	/* what Embree allocated, without our vertices and indices */
size_t accel_peak_bytes(const struct accel *a); /* the most of it, while it built */

/* Closest hit along the unit direction d, in (t_min, t_max). */
bool accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max,
		   struct ray_hit *hit);
/* Something lies between the two ends, or one of them lies on a surface that is hidden there (coincide.h), from which
 * no ray leaves either: the others say that they meet nothing, or something. */
bool accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to);
/* Something lies along the unit direction d, to infinity. */
bool accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d);

/* Version and instruction set, for the numeric fingerprint: "embree 3.13.5 avx2". */
const char *accel_version(void);

#endif
