/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What statistical tests share: p-values, seeds, random numbers. Pure; any thread; allocates nothing.
 */
#ifndef TESTS_SUPPORT_STATS_H
#define TESTS_SUPPORT_STATS_H

#include <stddef.h>
#include <stdint.h>

/* Probability of a chi-square of at least `x` with `degrees` degrees of freedom. */
double stats_chi2_p(double x, double degrees);

/* Two-sided: probability of |t| at least that large with `degrees` degrees of freedom. */
double stats_student_t_p(double t, double degrees);

/* Pearson's test of counts against expected counts; neighbouring cells are pooled, in order of expectation, until each
 * pool expects at least 5. A count where nothing at all is expected gives 0. Sorts nothing of the caller's. */
double stats_counts_p(const uint64_t *observed, const double *expected, size_t cells);

/* FNV-1a of a test's name: its seed. */
uint64_t stats_seed(const char *name);

/* Mean, standard error of the mean, two-sided p of the mean against `expected` from n independent values. */
struct stats_mean {
	double mean, error, p;
};
struct stats_mean stats_mean_test(const double *x, size_t n, double expected);

#endif
