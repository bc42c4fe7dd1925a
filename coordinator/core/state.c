/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/state.h"

#include "common/base/mem.h"

#include <assert.h>

/* Returns the index of the first of `count` entries whose id is not below `id`. The ids ascend. */
static uint32_t lower_bound(const struct farm *f, uint32_t count, uint64_t (*id_at)(const struct farm *f, uint32_t i),
			    uint64_t id)
{
	uint32_t low = 0, high = count;
	while (low < high) {
		uint32_t mid = low + (high - low) / 2;
		if (id_at(f, mid) < id)
			low = mid + 1;
		else
			high = mid;
	}
	return low;
}

static uint64_t job_id(const struct farm *f, uint32_t i)
{
	return f->jobs[i]->id;
}

static uint64_t peer_id(const struct farm *f, uint32_t i)
{
	return f->peers[i]->id;
}

uint32_t farm_peer_lower_bound(const struct farm *f, uint64_t id)
{
	return lower_bound(f, f->peer_count, peer_id, id);
}

struct job *farm_find_job(const struct farm *f, uint64_t id)
{
	uint32_t i = lower_bound(f, f->job_count, job_id, id);
	return i < f->job_count && f->jobs[i]->id == id ? f->jobs[i] : NULL;
}

struct peer *farm_find_peer(const struct farm *f, uint64_t id)
{
	uint32_t i = farm_peer_lower_bound(f, id);
	return i < f->peer_count && f->peers[i]->id == id ? f->peers[i] : NULL;
}

/* Upper bound per step: each lease is revoked at most once and replaced at most once, a worker whose table is full of
 * overdue leases loses some more, each worker is disconnected at most once, and a job causes a handful of actions. */
int update_reserve(struct farm *f, size_t more_leases)
{
	size_t leases = f->lease_capacity + more_leases;
	size_t capacity = 3 * leases + f->config.max_peers + 8 * (size_t)f->live_job_capacity + 64;
	if (capacity <= f->action_capacity)
		return 0;
	capacity += capacity / 2;
	void *p = mem_grow(f->actions, f->action_capacity * sizeof *f->actions, capacity * sizeof *f->actions);
	if (!p)
		return -ENOMEM;
	f->actions = p;
	f->action_capacity = capacity;
	return 0;
}

struct action *update_add(struct farm *f, enum action_kind kind)
{
	assert(f->action_count < f->action_capacity);
	struct action *a = &f->actions[f->action_count++];
	*a = (struct action){.kind = kind, .text = ""};
	return a;
}
