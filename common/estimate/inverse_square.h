/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The weight 1 / (B^2 + floor^2) of a brightness B with a known error: its moments over the normal distribution with
 * that mean and standard error. Pure; any thread; allocates nothing.
 */
#ifndef COMMON_ESTIMATE_INVERSE_SQUARE_H
#define COMMON_ESTIMATE_INVERSE_SQUARE_H

struct inverse_square {
	double mean, variance; /* of the weight; relative error 1e-3 */
};

/* error and floor above 0, all finite. Time grows with the logarithm of error / floor, and where the error is below
 * a fifth of the brightness. */
struct inverse_square inverse_square_expect(double brightness, double error, double floor);

#endif
