/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shared by statistical tests: p-values, seeds, random numbers. Pure; any thread; allocates nothing.
 */
#ifndef TESTS_SUPPORT_STATS_H
#define TESTS_SUPPORT_STATS_H

#include <stddef.h>
#include <stdint.h>

/* Returns the probability that a chi-square variable with `degrees` degrees of freedom is at least x. */
double stats_chi2_p(double x, double degrees);

/* Returns the two-sided probability that |t| is at least that large with `degrees` degrees of freedom. */
double stats_student_t_p(double t, double degrees);

/* Pearson's test of counts against expected counts; neighbouring cells are pooled, in the given order, until each
 * pool expects at least 5. A count where nothing at all is expected gives 0. The caller's arrays are not sorted. */
double stats_counts_p(const uint64_t *observed, const double *expected, size_t cells);

/* Returns the seed of a test: FNV-1a of its name. */
uint64_t stats_seed(const char *name);

/* The mean of n independent values, its standard error, and the two-sided p-value of the mean against `expected`. */
struct stats_mean {
	double mean, error, p;
};
struct stats_mean stats_mean_test(const double *x, size_t n, double expected);

#endif
