/* SPDX-License-Identifier: Apache-2.0 */
/* The smaller and the larger of two numbers that are not NaN: one instruction, where fmin and fmax, which must look
 * for NaN, are calls into libm. Functions that run at every vertex of a path use these. Pure; any thread. */
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
