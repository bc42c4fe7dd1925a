/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Keeps the largest of many positive numbers and estimates how fast they become rare.
 *
 * The tail index a is that of a Pareto distribution: a share y^-a of all numbers exceeds y. Below 2 the variance is
 * infinite, below 1 the mean: more samples keep finding larger ones, and the sum of a few samples is too small.
 * Estimated by Hill (1975, A simple general approach to inference about the tail of a distribution) from the k largest,
 * with a relative standard error of 1 / sqrt(k).
 *
 * The extreme-value index is 1 / a for such a distribution, and 0 or negative if the tail falls off faster than any
 * power or ends, which Hill's estimate cannot show. Estimated by the moments of Dekkers, Einmahl and de Haan (1989, A
 * moment estimator for the index of an extreme-value distribution), with a standard error of sqrt((1 + index^2) / k) if
 * it is positive.
 *
 * Numbers that are not positive and finite are ignored. One thread.
 */
#ifndef COMMON_ESTIMATE_TAIL_H
#define COMMON_ESTIMATE_TAIL_H

#include <stddef.h>

struct tail {
	size_t held, most; /* most: how many of the largest are kept; there is room for twice as many */
	double least;	   /* only numbers above this can be among the largest */
	double *y;
};

/* Keeps the `most` largest exactly. tail_fini frees. -ENOMEM */
int tail_init(struct tail *t, size_t most);
void tail_fini(struct tail *t);
void tail_clear(struct tail *t);
void tail_add(struct tail *t, double y);
/* Sorts: y[held] falls, until more numbers are added. */
void tail_settle(struct tail *t);
/* Hill's estimate from the k largest, k < most. 1 if no more than k were added or k is 0; INFINITY if they are all
 * equal. */
double tail_index(const struct tail *t, size_t k);
/* What an estimate from the k largest must exceed to rule out this index at the 5 % level. Based on the estimate's
 * standard error; since its distribution is skewed, the level is one in eleven at k = 32. INFINITY if k is 0. */
double tail_index_least(double index, size_t k);
/* The extreme-value index from the k largest, k < most. 1 if no more than k were added or k is 0; -INFINITY if they
 * are all equal. */
double tail_evi(const struct tail *t, size_t k);

#endif
