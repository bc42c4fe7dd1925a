/* SPDX-License-Identifier: Apache-2.0 */
/*
 * After each step: finishes jobs that have ended, merges results that waited for others, and starts a checkpoint if one
 * is due. When films are free again: the same without checkpoints; then results that arrived while the films were read
 * follow, one at a time, by the timer `drain`.
 */
#include "coordinator/jobs/follow_up.h"

#include "coordinator/jobs/checkpoint.h"
#include "coordinator/jobs/dispatch.h"
#include "coordinator/jobs/files.h"
#include "coordinator/jobs/finish.h"
#include "coordinator/jobs/late_feed.h"
#include "coordinator/jobs/results.h"

/* One at a time, so that nobody else waits for all of them. */
static void on_drain(uv_timer_t *t)
{
	struct jobs *jobs = t->data;
	struct live_job *job = jobs->live;
	while (job && (job->busy || STAILQ_EMPTY(&job->waiting) || files_are_read(jobs, job)))
		job = job->next;
	if (!job)
		return;
	struct waiting_batch *w = live_job_take_waiting(job);
	results_take_waiting(jobs, w);
	waiting_batch_free(w);
	if (!jobs->stopping)
		uv_timer_start(&jobs->drain, on_drain, 0, 0);
}

static void stepped(struct jobs *jobs)
{
	finish_ended(jobs);
	late_feed(jobs);
	checkpoint_where_due(jobs);
}

static void films_free(struct jobs *jobs)
{
	if (!jobs->stopping)
		uv_timer_start(&jobs->drain, on_drain, 0, 0);
	finish_ended(jobs);
	late_feed(jobs);
}

const struct follow_up follow_up = {.carry_out = dispatch_update, .stepped = stepped, .films_free = films_free};
