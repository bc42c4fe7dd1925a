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
			to->strategies[i][k] = add_saturated(to->strategies[i][k], from[i][k]);
}

void canvas_counts_add(struct canvas_counts *to, const struct canvas_counts *from)
{
	add_counters(to->counters, from->counters);
	add_strategies(to, from->strategies, BATCH_STRATEGIES);
}

void tally_add(struct tally *t, const struct batch *b)
{
	add_counters(t->counts.counters, b->counters);
	add_strategies(&t->counts, b->strategies, b->strategy_count);
	uint32_t g = b->key.group;
	t->groups[g].samples += b->counters[COUNT_SAMPLES];
	t->groups[g].independent += b->counters[COUNT_INDEPENDENT];
	bool finite = exact_sum_add(&t->groups[g].independent_sum, b->independent_sum) &&
		      exact_sum_add(&t->groups[g].overlong_sum, b->overlong_sum);
	assert(finite); /* batch_check */
	(void)finite;
}

/* COUNT_LONGEST_STUCK is left as it is: nothing can be subtracted from a maximum. */
void tally_subtract(struct tally *t, const struct batch *b)
{
	uint32_t g = b->key.group;
	for (int i = 0; i < BATCH_COUNTERS; i++)
		t->counts.counters[i] -= i == COUNT_LONGEST_STUCK ? 0 : b->counters[i];
	for (uint32_t i = 0; i < b->strategy_count; i++)
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			t->counts.strategies[i][k] -= b->strategies[i][k];
	t->groups[g].samples -= b->counters[COUNT_SAMPLES];
	t->groups[g].independent -= b->counters[COUNT_INDEPENDENT];
	bool finite = exact_sum_add(&t->groups[g].independent_sum, -b->independent_sum) &&
		      exact_sum_add(&t->groups[g].overlong_sum, -b->overlong_sum);
	assert(finite); /* as when the batch was added */
	(void)finite;
}

void tally_merge(struct tally *to, const struct tally *from, uint32_t groups)
{
	canvas_counts_add(&to->counts, &from->counts);
	for (uint32_t g = 0; g < groups; g++) {
		to->groups[g].samples += from->groups[g].samples;
		to->groups[g].independent += from->groups[g].independent;
		exact_sum_merge(&to->groups[g].independent_sum, &from->groups[g].independent_sum);
		exact_sum_merge(&to->groups[g].overlong_sum, &from->groups[g].overlong_sum);
	}
}
