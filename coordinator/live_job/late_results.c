/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/live_job/late_results.h"

#include "common/base/list.h"

#include <stdlib.h>
#include <string.h>

int late_results_add(struct live_job *job, const struct lease_key *k, uint64_t offset, struct error *e)
{
	struct late_result *more = list_grow_array(job->late_results, job->late_result_count, sizeof *more);
	if (!more)
		return error_set(e, ENOMEM, "no memory for results that wait");
	job->late_results = more;
	job->late_results[job->late_result_count++] = (struct late_result){.key = *k, .offset = offset};
	return 0;
}

void late_results_remove(struct live_job *job, size_t i)
{
	memmove(&job->late_results[i], &job->late_results[i + 1],
		(--job->late_result_count - i) * sizeof *job->late_results);
}

void late_results_remove_from_epoch(struct live_job *job, const struct lease_key *k)
{
	for (size_t i = job->late_result_count; i-- > 0;) {
		const struct lease_key *l = &job->late_results[i].key;
		if (l->kind == k->kind && l->group == k->group && l->part == k->part && l->epoch >= k->epoch)
			late_results_remove(job, i);
	}
}

static int compare_merge_order(const void *a, const void *b)
{
	const struct late_result *x = a, *y = b;
	if (x->key.kind != y->key.kind)
		return x->key.kind == LEASE_BOOTSTRAP ? -1 : 1;
	if (x->key.epoch != y->key.epoch)
		return x->key.epoch < y->key.epoch ? -1 : 1;
	return (x->offset > y->offset) - (x->offset < y->offset);
}

void late_results_sort(struct live_job *job)
{
	if (job->late_result_count)
		qsort(job->late_results, job->late_result_count, sizeof *job->late_results, compare_merge_order);
}

bool late_results_claim_lease(struct live_job *job, const struct lease_key *k, uint64_t peer)
{
	for (size_t i = 0; i < job->late_result_count; i++)
		if (lease_key_equal(&job->late_results[i].key, k)) {
			job->late_results[i].peer = peer;
			return true;
		}
	return false;
}
