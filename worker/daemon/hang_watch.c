/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Threads count ticks while they work (task.ticks). Each look compares the ticks of every lease and scene in work with
 * those of the last look; after STALL_CHECKS looks without a difference the thread counts as hung, and its lease fails,
 * or all leases that wait for its scene do. The thread itself cannot be ended: agent.c lets the other threads finish,
 * and the worker exits.
 */
#include "worker/daemon/hang_watch.h"

#include "worker/daemon/lease_list.h"
#include "worker/daemon/outgoing.h"

#include <stdio.h>

/* Looks are counted, not seconds, so that a worker that was stopped as a whole (SIGSTOP) does not count as hung. */
static bool detect_hang(struct task *t)
{
	unsigned long long now = atomic_load(&t->ticks);
	t->stalled_checks = now && now == t->last_ticks ? t->stalled_checks + 1 : 0;
	t->last_ticks = now;
	return t->stalled_checks >= STALL_CHECKS;
}

static bool fail_hung_leases(struct agent *a)
{
	char text[128];
	bool found = false;
	snprintf(text, sizeof text, "no progress for %g s: its thread hangs", a->config.stall_seconds);
	for (struct lease_task *l = a->leases; l; l = l->next) {
		if (l->state != LEASE_QUEUED || l->task.is_hung || !detect_hang(&l->task))
			continue;
		if (!l->is_unwanted)
			send_lease_failed(a, &l->grant.key, text, false);
		l->is_unwanted = l->task.is_hung = found = true;
		atomic_store(&l->stop_requested, true);
	}
	return found;
}

static bool fail_hung_builds(struct agent *a)
{
	bool found = false;
	for (struct job_cache *cache = a->job_caches; cache; cache = cache->next) {
		struct error e;
		if (cache->state != JOB_CACHE_BUILDING || cache->task.is_hung || !detect_hang(&cache->task))
			continue;
		error_set(&e, ETIMEDOUT, "no progress for %g s in building the scene: its thread hangs",
			  a->config.stall_seconds);
		lease_list_fail(a, cache, &e);
		cache->task.is_hung = found = true;
	}
	return found;
}

bool hang_watch_check(struct agent *a)
{
	bool lease = fail_hung_leases(a);
	return fail_hung_builds(a) || lease;
}
