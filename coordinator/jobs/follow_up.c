/* SPDX-License-Identifier: Apache-2.0 */
/*
 * After each step: jobs that have ended are finished, results that waited for others are merged, and a checkpoint is
 * begun where one is due. When films are free again: the same without checkpoints, and results that came while a job's
 * films were read follow, one at a time, by the timer `drain`.
 */
#include "coordinator/jobs/follow_up.h"

#include "coordinator/jobs/checkpoint.h"
#include "coordinator/jobs/dispatch.h"
#include "coordinator/jobs/finish.h"
#include "coordinator/jobs/late_feed.h"
#include "coordinator/jobs/results.h"

/* One at a time, so that nobody else waits for all of them. */
static void on_drain(uv_timer_t *t)
{
	struct jobs *s = t->data;
	struct live_job *job = s->live;
	while (job && (job->busy || !job->waiting))
		job = job->next;
	if (!job)
		return;
	struct waiting_batch *w = live_job_take_waiting(job);
	results_take(s, w->peer, &w->envelope, &w->payload);
	waiting_batch_free(w);
	if (!s->stopping)
		uv_timer_start(&s->drain, on_drain, 0, 0);
}

static void stepped(struct jobs *s)
{
	finish_ended(s);
	late_feed(s);
	checkpoint_where_due(s);
}

static void films_free(struct jobs *s)
{
	if (!s->stopping)
		uv_timer_start(&s->drain, on_drain, 0, 0);
	finish_ended(s);
	late_feed(s);
}

const struct follow_up follow_up = {.carry_out = dispatch_update, .stepped = stepped, .films_free = films_free};
