/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Intervals, and which of several settings lie on the front of error and bias. Pure; any thread; allocates nothing.
 */
#ifndef WORKER_CLI_ACCURACY_STATS_H
#define WORKER_CLI_ACCURACY_STATS_H

#include <stdbool.h>
#include <stddef.h>

struct interval {
	double value, low, high;
};

/* |t| of Student that is passed by chance with probability `level`, both sides together. */
double stats_t(double level, double degrees);

/* (mean a - mean b) / mean b with its interval at `level` by Welch's t; b_count 1: b is known exactly. NAN where b's
 * mean is not above 0 or a has fewer than two values. t: of the difference; may be NULL. */
struct interval stats_difference(const double *a, size_t a_count, const double *b, size_t b_count, double level,
				 double *t);

/* Sorts x. Median, and order statistics that hold it in 95 % of all cases (of few values: all of them). */
struct interval stats_median(double *x, size_t count);

/* One setting as the front sees it. */
struct stats_point {
	double log_error, log_sd; /* of the error at equal time, and its standard deviation */
	double bias_suspect;	  /* the least that the bias is by this setting's own interval, 0: it holds 0 */
	double bias_seen;	  /* ... when all settings are asked at once: what chance alone does not do */
	double bias_bound;	  /* the most that it may be */
	bool other_image;	  /* it is known to bias, seen or not: it beats nobody */
};

/*
 * j beats i when its error at equal time is surely less and nothing speaks for more bias: it is not more suspect, nor
 * may its bias be half as large again as i's; or when its bias is less (i's was seen, and none of j, or none that
 * large) and its error not surely more. What nobody beats is on the front. "Surely": at `level`, shared among the n - 1
 * others. by[i]: who beats i with the least error, or i itself when it is on the front.
 */
void stats_front(const struct stats_point *p, size_t n, double level, size_t *by);

#endif
