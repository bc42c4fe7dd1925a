/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Quantiles of the distributions of image errors. Pure; any thread; allocates nothing.
 */
#ifndef COMMON_ESTIMATE_QUANTILE_H
#define COMMON_ESTIMATE_QUANTILE_H

/* Returns the probability that a variable with the F distribution of (a, b) degrees of freedom, real and positive, is
 * below x: the regularised incomplete beta function, computed by its continued fraction (DLMF 8.17.22) in Lentz's form.
 */
double f_cdf(double x, double a, double b);

/* Returns the x with f_cdf(x, a, b) = p, for 0 < p < 1 and degrees from 1 to 1e9, to a relative 2^-24: the result is
 * rounded to float, so that it does not depend on the last bits of the C library's logarithm. */
double f_quantile(double p, double a, double b);

#endif
