/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The sums of what batches contain besides pixels: counters, and by group the samples and the independent samples of b.
 * Sums are exact, so the order does not matter and a batch can be subtracted. Pure.
 */
#ifndef COMMON_FILM_TALLY_H
#define COMMON_FILM_TALLY_H

#include "common/film/batch.h"
#include "common/film/exact_sum.h"

/* Sums over render batches, each merged once; COUNT_LONGEST_STUCK is their maximum. Strategies that the plan's
 * mixture does not have are 0. */
struct canvas_counts {
	uint64_t counters[BATCH_COUNTERS];
	uint64_t strategy[BATCH_STRATEGIES][STRATEGY_COUNTERS];
};
void canvas_counts_add(struct canvas_counts *to, const struct canvas_counts *from);

/* The counts of a round, of the prefix, or of the bootstrap. */
struct tally {
	struct canvas_counts counts;
	struct {
		uint64_t samples, independent;
		struct exact_sum sum, beyond;
	} group[PLAN_MAX_GROUPS];
};

void tally_add(struct tally *t, const struct batch *b);
void tally_take_back(struct tally *t,
		     const struct batch *b); /* the same as when it was added; COUNT_LONGEST_STUCK keeps its value */
void tally_merge(struct tally *to, const struct tally *from, uint32_t groups);

#endif
