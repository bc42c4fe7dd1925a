/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/job/late.h"

#include "common/base/mem.h"

#include <stdlib.h>
#include <string.h>

int late_add(struct live_job *o, const struct lease_key *k, uint64_t at, struct error *e)
{
	if (o->late_count == o->late_capacity) {
		size_t want = o->late_capacity ? 2 * o->late_capacity : 64;
		struct late_result *more = mem_grow(o->late, o->late_capacity * sizeof *more, want * sizeof *more);
		if (!more)
			return error_set(e, ENOMEM, "no memory for results that wait");
		o->late = more;
		o->late_capacity = want;
	}
	o->late[o->late_count++] = (struct late_result){.key = *k, .at = at};
	return 0;
}

void late_remove(struct live_job *o, size_t i)
{
	memmove(&o->late[i], &o->late[i + 1], (--o->late_count - i) * sizeof *o->late);
}

void late_forget(struct live_job *o, const struct lease_key *k)
{
	for (size_t i = o->late_count; i-- > 0;) {
		const struct lease_key *l = &o->late[i].key;
		if (l->kind == k->kind && l->group == k->group && l->part == k->part && l->epoch >= k->epoch)
			late_remove(o, i);
	}
}

static int by_time(const void *a, const void *b)
{
	const struct late_result *x = a, *y = b;
	if (x->key.kind != y->key.kind)
		return x->key.kind == LEASE_BOOTSTRAP ? -1 : 1;
	if (x->key.epoch != y->key.epoch)
		return x->key.epoch < y->key.epoch ? -1 : 1;
	return (x->at > y->at) - (x->at < y->at);
}

void late_sort(struct live_job *o)
{
	if (o->late_count)
		qsort(o->late, o->late_count, sizeof *o->late, by_time);
}

bool late_withholds(struct live_job *o, const struct lease_key *k, uint64_t peer)
{
	for (size_t i = 0; i < o->late_count; i++)
		if (lease_key_equal(&o->late[i].key, k)) {
			o->late[i].peer = peer;
			return true;
		}
	return false;
}
