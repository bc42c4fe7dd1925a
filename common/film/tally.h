/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The sums of the contents of batches other than pixels and moments: counters and, by group, the numbers of samples and
 * of independent samples and the sums from which b is estimated. Sums are exact, so the order does not matter and a
 * batch can be subtracted. Pure.
 */
#ifndef COMMON_FILM_TALLY_H
#define COMMON_FILM_TALLY_H

#include "common/film/batch.h"
#include "common/film/exact_sum.h"

/* Sums of the counters of batches; COUNT_LONGEST_STUCK is their maximum. The counters of strategies that the plan's
 * mixture does not have are 0. */
struct canvas_counts {
	uint64_t counters[BATCH_COUNTERS];
	uint64_t strategies[BATCH_STRATEGIES][STRATEGY_COUNTERS];
};
void canvas_counts_add(struct canvas_counts *to, const struct canvas_counts *from);

/* The counts of a round, of the prefix, or of the bootstrap. */
struct tally {
	struct canvas_counts counts;
	struct {
		uint64_t samples, independent;			/* sums of COUNT_SAMPLES and COUNT_INDEPENDENT */
		struct exact_sum independent_sum, overlong_sum; /* sums of independent_sum and overlong_sum */
	} groups[PLAN_GROUPS_MAX];
};

void tally_add(struct tally *t, const struct batch *b);
/* Subtracts a batch, which must be as it was added. COUNT_LONGEST_STUCK keeps its value. */
void tally_subtract(struct tally *t, const struct batch *b);
void tally_merge(struct tally *to, const struct tally *from, uint32_t groups);

#endif
