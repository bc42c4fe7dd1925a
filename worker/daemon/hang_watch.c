/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Threads count ticks while they work (task.ticks). Each look compares the ticks of every lease and scene in work with
 * those of the last look; after STALL_LOOKS looks without a difference the thread counts as hung, and its lease fails,
 * or all leases that wait for its scene do. The thread itself cannot be ended: agent.c lets the other threads finish,
 * and the worker exits.
 */
#include "worker/daemon/hang_watch.h"

#include "worker/daemon/lease_list.h"
#include "worker/daemon/outgoing.h"

#include <stdio.h>

/* Looks are counted, not seconds, so that a worker that was stopped as a whole (SIGSTOP) does not count as hung. */
static bool has_hung(struct task *t)
{
	unsigned long long now = atomic_load(&t->ticks);
	t->still = now && now == t->seen ? t->still + 1 : 0;
	t->seen = now;
	return t->still >= STALL_LOOKS;
}

static bool watch_leases(struct agent *a)
{
	char text[128];
	bool found = false;
	snprintf(text, sizeof text, "no progress for %g s: its thread hangs", a->config.stall_seconds);
	for (struct lease_task *l = a->leases; l; l = l->next) {
		if (l->state != LEASE_QUEUED || l->task.hung || !has_hung(&l->task))
			continue;
		if (!l->unwanted)
			send_failed(a, &l->grant.key, text, false);
		l->unwanted = l->task.hung = found = true;
		atomic_store(&l->stop, true);
	}
	return found;
}

static bool watch_builds(struct agent *a)
{
	bool found = false;
	for (struct job_cache *b = a->job_caches; b; b = b->next) {
		struct error e;
		if (b->state != JOB_CACHE_BUILDING || b->task.hung || !has_hung(&b->task))
			continue;
		error_set(&e, ETIMEDOUT, "no progress for %g s in building the scene: its thread hangs",
			  a->config.stall_seconds);
		lease_list_fail(a, b, &e);
		b->task.hung = found = true;
	}
	return found;
}

bool hang_watch_look(struct agent *a)
{
	bool lease = watch_leases(a);
	return watch_builds(a) || lease;
}
