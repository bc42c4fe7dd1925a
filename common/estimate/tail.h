/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Keeps the largest of many positive numbers and estimates how fast they become rare.
 *
 * The tail index a is that of a Pareto distribution, of which a share y^-a exceeds y. Below an index of 2 the variance
 * is infinite, below 1 the mean is: more samples keep finding larger ones, and the mean of a few samples is too small.
 * The index is estimated from the k largest numbers by the estimator of Hill (1975, A simple general approach to
 * inference about the tail of a distribution), with a relative standard error of 1 / sqrt(k).
 *
 * The extreme-value index is 1 / a for such a distribution. It is 0 or negative if the tail falls off faster than any
 * power, or ends, which Hill's estimator cannot show. It is estimated by the moment estimator of Dekkers, Einmahl and
 * de Haan (1989, A moment estimator for the index of an extreme-value distribution), with a standard error of sqrt((1 +
 * index^2) / k) if the index is positive.
 *
 * Numbers that are not positive and finite are ignored. One thread.
 */
#ifndef COMMON_ESTIMATE_TAIL_H
#define COMMON_ESTIMATE_TAIL_H

#include <stddef.h>

struct tail {
	size_t count;	   /* numbers in `values` */
	size_t kept_count; /* how many of the largest are kept; `values` has room for twice as many */
	double threshold;  /* only numbers above this can be among the largest */
	double *values;
};

/* Prepares to keep the `kept_count` largest numbers exactly. Returns 0 or -ENOMEM; tail_fini frees. */
int tail_init(struct tail *t, size_t kept_count);
void tail_fini(struct tail *t);
/* Forgets all numbers. */
void tail_clear(struct tail *t);
void tail_add(struct tail *t, double y);
/* Reduces `values` to the largest numbers, in descending order. Needed after the last tail_add, before the estimates
 * below. */
void tail_select_largest(struct tail *t);
/* Returns Hill's estimate from the k largest, k < kept_count: 1 if no more than k numbers were added or k is 0,
 * INFINITY if they are all equal. */
double tail_index(const struct tail *t, size_t k);
/* Returns the value that an estimate from the k largest must exceed to rule out this index, or a smaller one, at the 5
 * % level; INFINITY if k is 0. It is based on the estimate's standard error; since the estimate's distribution is
 * skewed, the actual level is one in eleven at k = 32. */
double tail_index_critical(double index, size_t k);
/* Returns the extreme-value index from the k largest, k < kept_count: 1 if no more than k numbers were added or k is 0,
 * -INFINITY if they are all equal. */
double tail_extreme_value_index(const struct tail *t, size_t k);

#endif
