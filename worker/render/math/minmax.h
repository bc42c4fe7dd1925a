/* SPDX-License-Identifier: Apache-2.0 */
/* The smaller and the larger of two numbers, which must not be NaN. They take one instruction, whereas fmin and fmax,
 * which check for NaN, are calls into libm. Used in functions that run at every vertex of a path. Pure; any thread. */
#ifndef WORKER_RENDER_MATH_MINMAX_H
#define WORKER_RENDER_MATH_MINMAX_H

static inline double min_of(double a, double b)
{
	return a < b ? a : b;
}

static inline double max_of(double a, double b)
{
	return a > b ? a : b;
}

#endif
