/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Quantiles of the distributions of image errors. Pure; any thread; allocates nothing.
 */
#ifndef COMMON_ESTIMATE_QUANTILE_H
#define COMMON_ESTIMATE_QUANTILE_H

/* Probability that an F with (a, b) degrees of freedom, real and positive, is below x: the regularised incomplete beta
 * function by its continued fraction (DLMF 8.17.22) in Lentz's form. */
double f_below(double x, double a, double b);

/* x with f_below(x, a, b) = p, 0 < p < 1, for degrees from 1 to 1e9, to a relative 2^-24: rounded to float, so that
 * libraries whose logarithms differ in the last bits agree. */
double f_quantile(double p, double a, double b);

#endif
