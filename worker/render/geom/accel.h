/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The only interface to Embree (3.13 or 4). Rays are in double; the result of a query is a primitive, on which
 * surface.h computes the hit again in double.
 *
 * Self-intersection: a ray names the primitive on which it starts (and, for a segment, the one on which it ends). A
 * plane triangle cannot be hit again from itself, so it is filtered out; on a sphere or a curve, the root at the start
 * (or end) is divided out of the quadratic. For every other triangle that Embree proposes, it is checked in double
 * whether the ray crosses the triangle's plane between the ends; it never crosses that of a coplanar neighbour, however
 * grazing it is. So the float ray given to Embree may deviate from the true one by the rounding errors of a scene of
 * that extent, and no absolute length is needed.
 *
 * In a scene whose smallest shape is less than 2^-11 of the scene's extent, that deviation would be too large. There a
 * ray deviates by the rounding errors at its position: floats are more precise near the origin
 * (worker/render/world/world_origin.h places small things there), a ray from far away is divided into parts that each
 * start closer to the origin, and triangles that are large relative to the smallest shape are intersected in double.
 *
 * Embree runs in robust mode with one build thread. It raises FE_INVALID on ordinary rays; the flag is cleared. An
 * accel is immutable after creation: any thread. Lengths are those of the rescaled world, whose radius is about 1.
 */
#ifndef WORKER_RENDER_GEOM_ACCEL_H
#define WORKER_RENDER_GEOM_ACCEL_H

#include "common/base/error.h"
#include "worker/render/geom/primitive.h"

#include <stdbool.h>
#include <stddef.h>

struct accel;
struct coincidence; /* coincide.h */

/* Builds the acceleration structure. c: the result of coincide_find for the shapes; NULL if nothing coincides. It must
 * outlive the accel, and so must the shapes' arrays. Returns -ENOMEM, -ENOTSUP or -EIO if it cannot be built. */
int accel_new(struct accel **out, const struct accel_shape *shapes, uint32_t count, const struct coincidence *c,
	      struct error *e);
void accel_free(struct accel *a);
size_t accel_bytes(const struct accel *a);	/* bytes allocated by Embree, not counting our vertices and indices */
size_t accel_peak_bytes(const struct accel *a); /* peak of accel_bytes during the build */

/* Finds the closest hit along the unit direction d, in (t_min, t_max). Returns false if there is none. */
bool accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max,
		   struct ray_hit *hit);
/* Whether something lies between the two ends, or one of them is on a surface that is hidden there (coincide.h), from
 * which no ray leaves. (For a ray that starts on a hidden surface, accel_closest finds nothing and
 * accel_occluded_to_infinity returns true.) */
bool accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to);
/* Whether something lies along the unit direction d, up to infinity. */
bool accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d);

/* Returns Embree's version and the instruction set for the numeric fingerprint: "embree 3.13.5 avx2". */
const char *accel_version(void);

#endif
