/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/find.h"

/* The first job whose id is not below `id`. */
static uint32_t job_place_of(const struct farm *f, uint64_t id)
{
	uint32_t low = 0, high = f->job_count;
	while (low < high) {
		uint32_t mid = low + (high - low) / 2;
		if (f->jobs[mid]->id < id)
			low = mid + 1;
		else
			high = mid;
	}
	return low;
}

uint32_t farm_peer_place(const struct farm *f, uint64_t id)
{
	uint32_t low = 0, high = f->peer_count;
	while (low < high) {
		uint32_t mid = low + (high - low) / 2;
		if (f->peers[mid]->id < id)
			low = mid + 1;
		else
			high = mid;
	}
	return low;
}

struct job *farm_find_job(const struct farm *f, uint64_t id)
{
	uint32_t i = job_place_of(f, id);
	return i < f->job_count && f->jobs[i]->id == id ? f->jobs[i] : NULL;
}

struct peer *farm_find_peer(const struct farm *f, uint64_t id)
{
	uint32_t i = farm_peer_place(f, id);
	return i < f->peer_count && f->peers[i]->id == id ? f->peers[i] : NULL;
}
