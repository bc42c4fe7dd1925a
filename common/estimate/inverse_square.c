/* SPDX-License-Identifier: Apache-2.0 */
/*
 * With the substitution B = f sinh u, dB / (B^2 + f^2) becomes du / (f cosh u): the integrand is smooth however small
 * the floor f is, and the trapezoidal rule converges exponentially.
 */
#include "common/estimate/inverse_square.h"

#include <math.h>

struct inverse_square inverse_square_moments(double brightness, double error, double floor)
{
	static const double range = 6; /* the integral covers so many standard errors on either side */
	double f = floor / error, b = brightness / error;
	double first = asinh((b - range) / f), last = asinh((b + range) / f);
	/* Longest step in u: half a standard deviation of B where its distribution is narrower than the weight. */
	double max_step = fmin(0.25, 0.5 / sqrt(b * b + f * f)), steps = ceil((last - first) / max_step);
	double h = (last - first) / steps, up = exp(first), ratio = exp(h), weight_sum = 0, square_sum = 0;
	for (double i = 0; i <= steps; i++, up *= ratio) {
		double down = 1 / up, deviation = f * (up - down) / 2 - b, secant = 2 / (up + down);
		double density = exp(-deviation * deviation / 2) * secant;
		weight_sum += density;
		square_sum += density * secant * secant;
	}
	double scale = h / sqrt(2 * M_PI) / (error * error);
	double mean = scale * weight_sum / f, square = scale * square_sum / (f * f * f) / (error * error);
	return (struct inverse_square){mean, fmax(0, square - mean * mean)};
}
