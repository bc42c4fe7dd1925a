/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A linked list in the order of grants, searched from the front: a worker holds only a few leases per thread. A lease
 * that a thread works on cannot be freed; it is marked as unwanted and dropped when the thread returns it. Nothing here
 * fails.
 */
#include "worker/daemon/lease_list.h"

#include "common/base/log.h"
#include "worker/daemon/outgoing.h"

void lease_list_drop(struct agent *a, struct lease_task *l)
{
	struct lease_task **at = &a->leases;
	while (*at != l)
		at = &(*at)->next;
	*at = l->next;
	a->last_busy_ms = uv_now(&a->loop);
	lease_task_free(l);
}

void lease_list_fail(struct agent *a, struct job_cache *cache, const struct error *e)
{
	log_event(LOG_WORLD_FAILED, "job=j%llu text=%s", log_u64_arg(cache->job), log_quote(e->text).text);
	for (struct lease_task *l = a->leases, *next; l; l = next) {
		next = l->next;
		if (l->job_cache != cache || l->state != LEASE_WAITING)
			continue;
		send_lease_failed(a, &l->grant.key, *e->text ? e->text : "the scene cannot be built",
				  cache->is_worker_at_fault);
		lease_list_drop(a, l);
	}
}

void lease_list_update_backlog(struct agent *a)
{
	enum { BACKLOG_MAX = 256, BACKLOG_RESUME = 128 };
	unsigned results = 0;
	for (const struct lease_task *l = a->leases; l; l = l->next)
		results += l->state == LEASE_RENDERED;
	bool backlog = a->has_backlog ? results > BACKLOG_RESUME : results >= BACKLOG_MAX;
	if (backlog == a->has_backlog)
		return;
	a->has_backlog = backlog;
	send_lease_request(a);
}

struct lease_task *lease_list_find(const struct agent *a, const struct lease_key *k)
{
	for (struct lease_task *l = a->leases; l; l = l->next)
		if (!l->is_unwanted && lease_key_equal(&l->grant.key, k))
			return l;
	return NULL;
}

void lease_list_forget(struct agent *a, struct lease_task *l)
{
	if (l->state == LEASE_QUEUED && !thread_pool_remove(a->thread_pool, &l->task)) {
		l->is_unwanted = true;
		atomic_store(&l->stop_requested, true);
		return;
	}
	lease_list_drop(a, l);
}

bool lease_list_is_flooded(const struct agent *a)
{
	unsigned open = 0;
	for (const struct lease_task *l = a->leases; l; l = l->next)
		open += l->state != LEASE_RENDERED;
	return open >= 4 * (a->config.threads + 1) + 16;
}

bool lease_list_is_full(const struct agent *a)
{
	enum { RESULTS_MAX = 1024 };
	unsigned results = 0;
	for (const struct lease_task *l = a->leases; l; l = l->next)
		results += l->state == LEASE_RENDERED;
	return results >= RESULTS_MAX;
}
