/* SPDX-License-Identifier: Apache-2.0 */
/* Three doubles, passed by value: points, directions, normals. World lengths are those of the rescaled scene. */
#ifndef WORKER_RENDER_MATH_VEC3_H
#define WORKER_RENDER_MATH_VEC3_H

#include <math.h>

typedef struct {
	double x, y, z;
} vec3;

static inline vec3 vec3_add(vec3 a, vec3 b)
{
	return (vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline vec3 vec3_sub(vec3 a, vec3 b)
{
	return (vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline vec3 vec3_scale(double s, vec3 a)
{
	return (vec3){s * a.x, s * a.y, s * a.z};
}

static inline vec3 vec3_madd(vec3 a, double s, vec3 b) /* a + s b */
{
	return (vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static inline vec3 vec3_neg(vec3 a)
{
	return (vec3){-a.x, -a.y, -a.z};
}

static inline double vec3_dot(vec3 a, vec3 b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline vec3 vec3_cross(vec3 a, vec3 b)
{
	return (vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double vec3_length(vec3 a)
{
	return sqrt(vec3_dot(a, a));
}

static inline vec3 vec3_normalize(vec3 a)
{
	return vec3_scale(1.0 / vec3_length(a), a);
}

/* Returns the angle in [0, pi], accurate for small angles, too. The vectors need not have unit length. */
static inline double vec3_angle(vec3 a, vec3 b)
{
	return atan2(vec3_length(vec3_cross(a, b)), vec3_dot(a, b));
}

/* Returns the coordinate along axis 0, 1 or 2. */
static inline double vec3_component(vec3 v, unsigned axis)
{
	return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static inline int vec3_is_finite(vec3 a)
{
	return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

#endif
