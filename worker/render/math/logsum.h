/* SPDX-License-Identifier: Apache-2.0 */
/* Sums of numbers given by their logarithms. */
#ifndef WORKER_RENDER_MATH_LOGSUM_H
#define WORKER_RENDER_MATH_LOGSUM_H

#include <math.h>

/* Returns the logarithm of the sum of exp(v[i]); -INFINITY if there are no terms or all are zero. */
static inline double log_sum_exp(const double *v, unsigned n)
{
	double max = -INFINITY, sum = 0;
	for (unsigned i = 0; i < n; i++)
		max = fmax(max, v[i]);
	if (!(max > -INFINITY))
		return -INFINITY;
	for (unsigned i = 0; i < n; i++)
		sum += exp(v[i] - max);
	return max + log(sum);
}

#endif
