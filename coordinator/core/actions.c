/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/actions.h"

#include "common/base/mem.h"

#include <assert.h>

/* Bounds per step: each lease is revoked at most once and replaced at most once, a worker whose table is full of
 * overdue leases loses some more, each worker is disconnected once, and a job causes a handful of actions. */
int update_reserve(struct farm *f, size_t more_leases)
{
	size_t leases = f->lease_limit + more_leases;
	size_t want = 3 * leases + f->config.max_peers + 8 * (size_t)f->live_limit + 64;
	if (want <= f->action_limit)
		return 0;
	want += want / 2;
	void *p = mem_grow(f->actions, f->action_limit * sizeof *f->actions, want * sizeof *f->actions);
	if (!p)
		return -ENOMEM;
	f->actions = p;
	f->action_limit = want;
	return 0;
}

struct action *update_add(struct farm *f, enum action_kind kind)
{
	assert(f->action_count < f->action_limit);
	struct action *a = &f->actions[f->action_count++];
	*a = (struct action){.kind = kind, .text = ""};
	return a;
}
