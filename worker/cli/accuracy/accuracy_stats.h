/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Intervals, and which of several settings are on the front of error and bias. Pure; any thread; allocates nothing.
 */
#ifndef WORKER_CLI_ACCURACY_STATS_H
#define WORKER_CLI_ACCURACY_STATS_H

#include <stdbool.h>
#include <stddef.h>

struct interval {
	double value, low, high;
};

/* The |t| of Student's distribution that is exceeded by chance with probability `level`, both sides together. */
double stats_t(double level, double degrees);

/* (mean a - mean b) / mean b with its interval at `level` by Welch's t; b_count 1: b is known exactly. NAN where b's
 * mean is not above 0 or a has fewer than two values. t: of the difference; may be NULL. */
struct interval stats_difference(const double *a, size_t a_count, const double *b, size_t b_count, double level,
				 double *t);

/* Sorts x. Median, and order statistics that enclose it in 95 % of all cases (of few values: the extremes). */
struct interval stats_median(double *x, size_t count);

/* One setting, as the front sees it. */
struct stats_point {
	double log_error, log_sd; /* of the error at equal time, and its standard deviation */
	double bias_suspect;	  /* lower bound of the bias by this setting's own interval, 0: it contains 0 */
	double bias_seen;	  /* ... when all settings are tested together: not explained by chance */
	double bias_bound;	  /* upper bound */
	bool other_image; /* biased by design, whether or not it shows: it is never better than another setting */
};

/*
 * j beats i if its error at equal time is certainly smaller and nothing suggests more bias: it is not more suspect, and
 * its bias cannot be half as large again as i's; or if its bias is smaller (i's was seen, and j's was not, or is
 * smaller) and its error not certainly larger. Settings that nobody beats are on the front. "Certainly": at `level`,
 * shared among the n - 1 others. by[i]: of those that beat i the one with the smallest error, or i itself if it is on
 * the front.
 */
void stats_front(const struct stats_point *p, size_t n, double level, size_t *by);

#endif
