/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The weight 1 / (B^2 + floor^2) of a brightness B that is known with an error: its moments over the normal law of that
 * mean and that standard error. Pure; any thread; allocates nothing.
 */
#ifndef COMMON_ESTIMATE_INVERSE_SQUARE_H
#define COMMON_ESTIMATE_INVERSE_SQUARE_H

struct inverse_square {
	double mean, variance; /* of the weight; relative error 1e-3 */
};

/* error and floor above 0, all finite. Takes time by the logarithm of error / floor, and more where the error is below
 * a fifth of the brightness. */
struct inverse_square inverse_square_expect(double brightness, double error, double floor);

#endif
