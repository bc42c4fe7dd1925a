/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Computes intervals, and which settings are on the Pareto front of error and bias. Pure; any thread; allocates
 * nothing.
 */
#ifndef WORKER_CLI_ACCURACY_ACCURACY_STATS_H
#define WORKER_CLI_ACCURACY_ACCURACY_STATS_H

#include <stdbool.h>
#include <stddef.h>

struct interval {
	double value, low, high;
};

/* Returns the |t| of Student's distribution that is exceeded with probability `level`, both sides together. */
double stats_t_quantile(double level, double degrees);

/* Returns (mean a - mean b) / mean b with its interval by Welch's t, which misses the true value with probability
 * `level`. b_count 1: b is known exactly. The result is NAN if b's mean is not above 0, or a has fewer than two values.
 * *t: the difference in standard deviations; t may be NULL. */
struct interval stats_relative_difference(const double *a, size_t a_count, const double *b, size_t b_count,
					  double level, double *t);

/* Returns the median, and order statistics that enclose the true median in 95 % of all cases (the extremes, if there
 * are few values). Sorts x. */
struct interval stats_median(double *x, size_t count);

/* The figures of one setting by which stats_front compares it. */
struct front_point {
	double log_error, log_sd; /* logarithm of the error at equal time, and its standard deviation */
	double bias_lower_single; /* lower bound of the bias by the interval of this setting alone; 0: it contains 0 */
	double bias_lower_joint;  /* lower bound when all settings are tested together; above 0: chance does not explain
				     it */
	double bias_upper;	  /* upper bound of the bias */
	bool changes_image; /* biased by design, even if the bias does not show: never better than another setting */
};

/*
 * Finds the settings on the front, which no other setting beats. Setting j beats setting i
 * - if j's error at equal time is certainly smaller, and nothing suggests more bias: j's bias_lower_single is not
 * larger, and its bias_upper is not above 1.5 times i's;
 * - or if j's bias is smaller (j's bound is below i's bias_lower_joint; or i's bias was seen, j's is not even
 * suspected, and j's bound is not above 1.5 times i's), and j's error is not certainly larger. "Certainly" means: with
 * a probability of error of `level`, shared among the n - 1 other settings. dominated_by[i]: of the settings that beat
 * i, the one with the smallest error; i itself if it is on the front.
 */
void stats_front(const struct front_point *p, size_t n, double level, size_t *dominated_by);

#endif
