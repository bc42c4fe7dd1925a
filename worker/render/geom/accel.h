/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The only interface to Embree (3.13 or 4). Rays are in double; the result is a primitive, on which surface.h computes
 * the hit again in double.
 *
 * Self-intersection: a ray names the primitive it starts on (and, for a segment, the one it ends on). A plane triangle
 * cannot be hit again from itself, so it is filtered; on a sphere or a curve, the root of the start (or end) is divided
 * out of the quadratic. For every other triangle that Embree proposes, it is checked in double whether the ray crosses
 * its plane between the ends: that of a coplanar neighbour is not, however grazing the ray. So the float ray given to
 * Embree may deviate from the true one by the rounding errors of a scene of that extent, never by an absolute length.
 *
 * In a scene whose smallest shape is less than 2^-11 of it, that would be too much. There a ray deviates by the
 * rounding errors at its position: floats are more precise near the origin (worker/render/world/origin.h puts small
 * things there), a ray from far away is divided into parts that each start nearer, and triangles that are large
 * relative to the smallest shape are intersected in double.
 *
 * Embree runs in robust mode with one build thread. It raises INVALID on ordinary rays, which is cleared. Immutable
 * after creation: any thread. Lengths are those of the rescaled world, whose radius is about 1.
 */
#ifndef WORKER_RENDER_GEOM_ACCEL_H
#define WORKER_RENDER_GEOM_ACCEL_H

#include "common/base/error.h"
#include "worker/render/geom/primitive.h"

#include <stdbool.h>
#include <stddef.h>

struct accel;
struct coincidence; /* coincide.h */

/* c: the result of coincide_find for the shapes; NULL: nothing coincides. It must outlive the accel. */
int accel_new(struct accel **a, const struct accel_shape *shapes, uint32_t count, const struct coincidence *c,
	      struct error *e);
void accel_free(struct accel *a);
size_t accel_bytes(const struct accel *a);	/* allocated by Embree, without our vertices and indices */
size_t accel_peak_bytes(const struct accel *a); /* the peak, while building */

/* Closest hit along the unit direction d, in (t_min, t_max). */
bool accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max,
		   struct ray_hit *hit);
/* Whether something lies between the two ends, or one of them is on a surface that is hidden there (coincide.h),
 * from which no ray leaves. (For the other functions such a ray hits nothing, or something.) */
bool accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to);
/* Something lies along the unit direction d, to infinity. */
bool accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d);

/* Version and instruction set, for the numeric fingerprint: "embree 3.13.5 avx2". */
const char *accel_version(void);

#endif
