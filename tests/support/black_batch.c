/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/black_batch.h"

#include "common/base/mem.h"

static void add_weights(struct batch *b, const struct plan *plan)
{
	struct plan_range range = plan_bootstrap_range(plan, b->key.group, b->key.part);
	b->weight_count = b->counters[COUNT_INDEPENDENT] = b->counters[COUNT_SAMPLES] = range.end - range.begin;
	b->weights = mem_alloc(b->weight_count, sizeof *b->weights);
}

static void add_chains(struct batch *b, const struct plan *plan, uint32_t state_bytes)
{
	struct plan_range chains = plan_chain_range(plan, b->key.part);
	b->state_count = (uint32_t)(chains.end - chains.begin);
	b->states = mem_alloc(b->state_count, sizeof *b->states);
	for (uint32_t i = 0; i < b->state_count; i++)
		b->states[i] = (struct chain_state){mem_alloc(state_bytes, 1), state_bytes};
	b->moment_count = batch_moment_count(plan, LEASE_RENDER);
	b->moments = mem_alloc(b->moment_count, sizeof *b->moments);
	b->counters[COUNT_SAMPLES] = b->state_count * plan->epoch;
}

struct batch black_batch(const struct lease_key *k, const struct plan *plan, uint32_t state_bytes)
{
	struct batch b = {.key = *k};
	if (k->kind == LEASE_BOOTSTRAP) {
		add_weights(&b, plan);
	} else if (plan->kind == PLAN_SAMPLES) {
		struct plan_range rows = plan_row_range(plan, k->part);
		b.counters[COUNT_SAMPLES] =
			(rows.end - rows.begin) * (plan->crop_width + 2 * (uint64_t)plan->border) * plan->epoch;
	} else {
		add_chains(&b, plan, state_bytes);
	}
	return b;
}
