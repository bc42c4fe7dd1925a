/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/tally.h"

#include <assert.h>

static uint64_t add_saturated(uint64_t a, uint64_t b)
{
	return a > UINT64_MAX - b ? UINT64_MAX : a + b;
}

static void add_counters(uint64_t to[BATCH_COUNTERS], const uint64_t from[BATCH_COUNTERS])
{
	for (int i = 0; i < BATCH_COUNTERS; i++) {
		if (i == COUNT_LONGEST_STUCK)
			to[i] = from[i] > to[i] ? from[i] : to[i];
		else
			to[i] = add_saturated(to[i], from[i]);
	}
}

static void add_strategies(struct canvas_counts *to, const uint64_t (*from)[STRATEGY_COUNTERS], uint32_t count)
{
	for (uint32_t i = 0; i < count; i++)
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			to->strategy[i][k] = add_saturated(to->strategy[i][k], from[i][k]);
}

void canvas_counts_add(struct canvas_counts *to, const struct canvas_counts *from)
{
	add_counters(to->counters, from->counters);
	add_strategies(to, from->strategy, BATCH_STRATEGIES);
}

void tally_add(struct tally *t, const struct batch *b)
{
	add_counters(t->counts.counters, b->counters);
	add_strategies(&t->counts, b->strategy, b->strategy_count);
	uint32_t g = b->key.group;
	t->group[g].samples += b->counters[COUNT_SAMPLES];
	t->group[g].independent += b->counters[COUNT_INDEPENDENT];
	bool finite = exact_sum_add(&t->group[g].sum, b->independent_sum) &&
		      exact_sum_add(&t->group[g].beyond, b->beyond_sum);
	assert(finite); /* batch_check */
	(void)finite;
}

/* COUNT_LONGEST_STUCK is left as it is: nothing can be subtracted from a maximum. */
void tally_take_back(struct tally *t, const struct batch *b)
{
	uint32_t g = b->key.group;
	for (int i = 0; i < BATCH_COUNTERS; i++)
		t->counts.counters[i] -= i == COUNT_LONGEST_STUCK ? 0 : b->counters[i];
	for (uint32_t i = 0; i < b->strategy_count; i++)
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			t->counts.strategy[i][k] -= b->strategy[i][k];
	t->group[g].samples -= b->counters[COUNT_SAMPLES];
	t->group[g].independent -= b->counters[COUNT_INDEPENDENT];
	bool finite = exact_sum_add(&t->group[g].sum, -b->independent_sum) &&
		      exact_sum_add(&t->group[g].beyond, -b->beyond_sum);
	assert(finite); /* as when the batch was added */
	(void)finite;
}

void tally_merge(struct tally *to, const struct tally *from, uint32_t groups)
{
	canvas_counts_add(&to->counts, &from->counts);
	for (uint32_t g = 0; g < groups; g++) {
		to->group[g].samples += from->group[g].samples;
		to->group[g].independent += from->group[g].independent;
		exact_sum_merge(&to->group[g].sum, &from->group[g].sum);
		exact_sum_merge(&to->group[g].beyond, &from->group[g].beyond);
	}
}
