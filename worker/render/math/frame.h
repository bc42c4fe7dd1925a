/* SPDX-License-Identifier: Apache-2.0 */
/* An orthonormal frame; its local z axis is n. */
#ifndef WORKER_RENDER_MATH_FRAME_H
#define WORKER_RENDER_MATH_FRAME_H

#include "worker/render/math/vec3.h"

struct frame {
	vec3 s, t, n;
};

static inline vec3 frame_to_local(const struct frame *f, vec3 v)
{
	return (vec3){vec3_dot(f->s, v), vec3_dot(f->t, v), vec3_dot(f->n, v)};
}

static inline vec3 frame_to_world(const struct frame *f, vec3 v)
{
	return vec3_madd(vec3_madd(vec3_scale(v.x, f->s), v.y, f->t), v.z, f->n);
}

/* Returns a frame expressed in the coordinates of another one. */
static inline struct frame frame_relative_to(const struct frame *outer, const struct frame *f)
{
	return (struct frame){frame_to_local(outer, f->s), frame_to_local(outer, f->t), frame_to_local(outer, f->n)};
}

/* Returns some frame around the unit vector n (Duff et al. 2017, Building an Orthonormal Basis, Revisited, sec. 3). */
static inline struct frame frame_around(vec3 n)
{
	double sign = copysign(1.0, n.z);
	double a = -1.0 / (sign + n.z), b = n.x * n.y * a;
	return (struct frame){{1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

/* Returns the shading frame of constraints: s is du made orthogonal to n. There is a fallback if du is parallel to n,
 * or its square underflows, which happens within 1e-150 of a sphere's pole. */
static inline struct frame frame_along(vec3 n, vec3 du)
{
	vec3 s = vec3_madd(du, -vec3_dot(n, du), n);
	double l = vec3_length(s);
	if (!(l > 1e-12 * vec3_length(du)) || !(l > 0x1p-500) || !isfinite(l))
		return frame_around(n);
	s = vec3_scale(1.0 / l, s);
	return (struct frame){s, vec3_cross(n, s), n};
}

#endif
