/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The largest of many positive numbers, and how fast such become rare.
 *
 * The tail index a is that of a Pareto law: of all numbers beyond y the share y^-a. Below 2 their variance is infinite,
 * below 1 their mean: more of them keep on finding larger ones, and what a few say of the sum is too small. Estimated
 * by Hill (1975, A simple general approach to inference about the tail of a distribution) from the k largest, with a
 * relative standard error of 1 / sqrt(k).
 *
 * The extreme-value index is 1 / a of such a law, and 0 or less where the tail falls off faster than any power or has
 * an end, which Hill's estimate cannot say. Estimated by the moments of Dekkers, Einmahl and de Haan (1989, A moment
 * estimator for the index of an extreme-value distribution), with a standard error of sqrt((1 + index^2) / k) where it
 * is positive.
 *
 * Numbers are positive and finite; others are left out. One thread.
 */
#ifndef COMMON_ESTIMATE_TAIL_H
#define COMMON_ESTIMATE_TAIL_H

#include <stddef.h>

struct tail {
	size_t held, most; /* most: of the largest that are kept; there is room for twice as many */
	double least;	   /* as many are known to be no less */
	double *y;
};

/* The `most` largest are kept exactly. tail_fini frees. -ENOMEM */
int tail_init(struct tail *t, size_t most);
void tail_fini(struct tail *t);
void tail_clear(struct tail *t);
void tail_add(struct tail *t, double y);
/* Sorts: until more are added y[held] falls. */
void tail_settle(struct tail *t);
/* By the k largest, k < most. 1 where no more than k were added or k is 0; INFINITY where they are all equal. */
double tail_index(const struct tail *t, size_t k);
/* What an estimate by the k largest must exceed to rule out a law of this index: one of them in twenty does, for many.
 * By the estimate's standard error; as its law is skewed, one in eleven at k = 32. INFINITY where k is 0. */
double tail_index_least(double index, size_t k);
/* The extreme-value index by the k largest, k < most. 1 where no more than k were added or k is 0; -INFINITY where they
 * are all equal. */
double tail_evi(const struct tail *t, size_t k);

#endif
