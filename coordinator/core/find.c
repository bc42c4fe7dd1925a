/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/find.h"

/* The index of the first of `count` whose id is not below `id`; ids ascend. */
static uint32_t place_of(const struct farm *f, uint32_t count, uint64_t (*id_at)(const struct farm *f, uint32_t i),
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

uint32_t farm_peer_place(const struct farm *f, uint64_t id)
{
	return place_of(f, f->peer_count, peer_id, id);
}

struct job *farm_find_job(const struct farm *f, uint64_t id)
{
	uint32_t i = place_of(f, f->job_count, job_id, id);
	return i < f->job_count && f->jobs[i]->id == id ? f->jobs[i] : NULL;
}

struct peer *farm_find_peer(const struct farm *f, uint64_t id)
{
	uint32_t i = farm_peer_place(f, id);
	return i < f->peer_count && f->peers[i]->id == id ? f->peers[i] : NULL;
}
