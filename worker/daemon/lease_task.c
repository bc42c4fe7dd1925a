/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/lease_task.h"

#include "common/base/mem.h"
#include "worker/daemon/crash_record.h"

#include <string.h>

int lease_task_new(struct lease_task **out, struct grant *g, struct job_cache *cache, struct error *e)
{
	struct lease_task *l = mem_alloc(1, sizeof *l);
	if (!l)
		return error_set(e, ENOMEM, "no memory for a lease");
	l->grant = *g;
	memset(g, 0, sizeof *g);
	l->job_cache = cache;
	cache->lease_count++;
	atomic_init(&l->stop_requested, false);
	*out = l;
	return 0;
}

void lease_task_free(struct lease_task *l)
{
	l->job_cache->lease_count--;
	grant_fini(&l->grant);
	mem_free(l->frame);
	mem_free(l);
}

/* Renders a lease on a render thread and packs the result there, so that the loop's thread never encodes films. */
static void render_task(struct task *t)
{
	struct lease_task *l = (struct lease_task *)t; /* its first member */
	struct batch batch = {0};
	struct lease_input in = {.chain_count = l->grant.chain_count,
				 .seeds = l->grant.seeds,
				 .states = l->grant.states,
				 .map = l->job_cache->brightness_map};
	const struct plan *p = &l->job_cache->plan;
	l->outcome = LEASE_STOPPED;
	crash_record_begin(&l->grant.key, l->job_cache->info.message->job_info->scene);
	if (!atomic_load(&l->stop_requested))
		l->rc = render_lease(l->job_cache->world, p, &l->grant.key, &in, &l->stop_requested, &l->outcome,
				     &batch, &l->error);
	/* The coordinator would refuse such a result: report a failure instead. */
	if (!l->rc && l->outcome == LEASE_DONE)
		l->rc = batch_check(&batch, p, &l->error);
	if (l->rc)
		error_prefix(&l->error, l->rc, "%s", l->job_cache->info.message->job_info->scene);
	if (!l->rc && l->outcome == LEASE_DONE)
		l->rc = batch_pack(&batch, p, &l->frame, &l->frame_size, &l->error);
	batch_fini(&batch);
	crash_record_end();
}

static void on_task_done(struct task *t)
{
	struct lease_task *l = (struct lease_task *)t;
	l->on_finished(l);
}

void lease_task_start(struct lease_task *l, struct thread_pool *c)
{
	l->state = LEASE_QUEUED;
	l->task.run = render_task;
	l->task.on_done = on_task_done;
	thread_pool_add(c, &l->task);
}
