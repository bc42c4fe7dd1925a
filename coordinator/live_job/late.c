/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/live_job/late.h"

#include "common/base/list.h"

#include <stdlib.h>
#include <string.h>

int late_add(struct live_job *job, const struct lease_key *k, uint64_t at, struct error *e)
{
	struct late_result *more = list_room(job->late, job->late_count, sizeof *more);
	if (!more)
		return error_set(e, ENOMEM, "no memory for results that wait");
	job->late = more;
	job->late[job->late_count++] = (struct late_result){.key = *k, .at = at};
	return 0;
}

void late_remove(struct live_job *job, size_t i)
{
	memmove(&job->late[i], &job->late[i + 1], (--job->late_count - i) * sizeof *job->late);
}

void late_forget(struct live_job *job, const struct lease_key *k)
{
	for (size_t i = job->late_count; i-- > 0;) {
		const struct lease_key *l = &job->late[i].key;
		if (l->kind == k->kind && l->group == k->group && l->part == k->part && l->epoch >= k->epoch)
			late_remove(job, i);
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

void late_sort(struct live_job *job)
{
	if (job->late_count)
		qsort(job->late, job->late_count, sizeof *job->late, by_time);
}

bool late_withholds(struct live_job *job, const struct lease_key *k, uint64_t peer)
{
	for (size_t i = 0; i < job->late_count; i++)
		if (lease_key_equal(&job->late[i].key, k)) {
			job->late[i].peer = peer;
			return true;
		}
	return false;
}
