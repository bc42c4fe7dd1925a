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
#include "worker/render/geom/primitive.h"

#include <stdbool.h>
#include <stddef.h>

struct accel;
struct coincidence; /* coincide.h */

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
