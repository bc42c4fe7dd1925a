/* Pairs and 2x2 matrices by copy: tangent coordinates, half vectors, blocks of constraint derivatives. */
#ifndef WORKER_MATH_MAT2_H
#define WORKER_MATH_MAT2_H

#include <math.h>
#include <stdbool.h>

typedef struct {
	double x, y;
} vec2;

typedef struct {
	double xx, xy, yx, yy; /* row, column */
} mat2;

static inline vec2 vec2_add(vec2 a, vec2 b)
{
	return (vec2){a.x + b.x, a.y + b.y};
}

static inline vec2 vec2_sub(vec2 a, vec2 b)
{
	return (vec2){a.x - b.x, a.y - b.y};
}

static inline vec2 vec2_scale(double s, vec2 a)
{
	return (vec2){s * a.x, s * a.y};
}

static inline double vec2_dot(vec2 a, vec2 b)
{
	return a.x * b.x + a.y * b.y;
}

static inline vec2 mat2_apply(mat2 m, vec2 v)
{
	return (vec2){m.xx * v.x + m.xy * v.y, m.yx * v.x + m.yy * v.y};
}

static inline mat2 mat2_mul(mat2 a, mat2 b)
{
	return (mat2){a.xx * b.xx + a.xy * b.yx, a.xx * b.xy + a.xy * b.yy, a.yx * b.xx + a.yy * b.yx, a.yx * b.xy + a.yy * b.yy};
}

static inline mat2 mat2_sub(mat2 a, mat2 b)
{
	return (mat2){a.xx - b.xx, a.xy - b.xy, a.yx - b.yx, a.yy - b.yy};
}

static inline mat2 mat2_of_columns(vec2 a, vec2 b)
{
	return (mat2){a.x, b.x, a.y, b.y};
}

static inline mat2 mat2_scale(double s, mat2 a)
{
	return (mat2){s * a.xx, s * a.xy, s * a.yx, s * a.yy};
}

static inline double mat2_det(mat2 m)
{
	return m.xx * m.yy - m.xy * m.yx;
}

/* Sum of squares of the entries. */
static inline double mat2_norm2(mat2 m)
{
	return m.xx * m.xx + m.xy * m.xy + m.yx * m.yx + m.yy * m.yy;
}

/* The largest magnitude among the entries. */
static inline double mat2_largest(mat2 m)
{
	return fmax(fmax(fabs(m.xx), fabs(m.xy)), fmax(fabs(m.yx), fabs(m.yy)));
}

/* The adjugate: the inverse times the determinant. */
static inline mat2 mat2_adjugate(mat2 m)
{
	return (mat2){m.yy, -m.xy, -m.yx, m.xx};
}

#endif
