/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Moments of the weight 1 / (B^2 + floor^2) if the brightness B is only known to be normally distributed, with a given
 * mean and standard error. Pure; any thread; allocates nothing.
 */
#ifndef COMMON_ESTIMATE_INVERSE_SQUARE_H
#define COMMON_ESTIMATE_INVERSE_SQUARE_H

struct inverse_square {
	double mean, variance; /* of the weight; correct to a relative 1e-3 */
};

/* brightness, error: mean and standard error of B. error and floor must be above 0, and all arguments finite. The time
 * grows with the logarithm of error / floor, and also if the error is below a fifth of the brightness. */
struct inverse_square inverse_square_moments(double brightness, double error, double floor);

#endif
