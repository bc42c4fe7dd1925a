/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The end of a live job. A job that the core has ended is finished as soon as no thread reads its films: its record
 * is written and its row ended (durable.h), workers are told, its memory is freed. If the disk refuses the record,
 * finishing is tried again (start.c), and until then the job counts as running.
 */
#include "coordinator/jobs/finish.h"

#include "common/base/clock.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/extend.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/results.h"
#include "coordinator/retention/ages.h"
#include "coordinator/retention/clear.h"
#include "coordinator/retention/keep.h"

static struct job_record record_of(const struct jobs *jobs, const struct live_job *job)
{
	struct job_view v;
	jobs_view_end(jobs, job, &v);
	v.record.ended_seen = ages_now(jobs);
	if (!v.record.cut)
		v.record.ended = clock_wall_seconds();
	return v.record;
}

static void finish(struct jobs *jobs, struct live_job *job)
{
	job->record = record_of(jobs, job);
	if (durable_end(jobs, job)) { /* start.c tries again */
		job->unrecorded = true;
		job->try_again = jobs_now(jobs) + jobs->config.retry_seconds;
		return;
	}
	ended_jobs_add(jobs, &job->record);
	jobs->peers.job_ended(jobs->peers.user, job->id);
	keep_trim(jobs);
	clear_soon(jobs);
	live_job_release_blobs(live_job_submit(job), jobs->blobs);
	struct live_job **at = &jobs->live;
	while (*at != job)
		at = &(*at)->next;
	*at = job->next;
	struct waiting_list late = STAILQ_HEAD_INITIALIZER(late);
	STAILQ_CONCAT(&late, &job->waiting);
	live_job_free(job);
	for (struct waiting_batch *w; (w = STAILQ_FIRST(&late));) { /* the core refuses them, since the job is over */
		STAILQ_REMOVE_HEAD(&late, next);
		results_take_waiting(jobs, w);
		waiting_batch_free(w);
	}
}

int finish_cancelled(struct jobs *jobs, uint64_t id, struct error *e)
{
	struct live_job *job = jobs_find(jobs, id);
	if (!job)
		return durable_ended(jobs, id, e);
	if (!job->ended)
		return 0;
	struct job_record r = record_of(jobs, job);
	return durable_end_soon(jobs, job, &r, e);
}

void finish_ended(struct jobs *jobs)
{
	bool finished = false;
	for (struct live_job *job = jobs->live, *next; job; job = next) {
		next = job->next;
		if (job->ended && !job->busy && !job->unpublished && !job->unrecorded) {
			finish(jobs, job);
			finished = true;
			next = jobs->live; /* results that waited may have ended other jobs */
		}
	}
	if (finished)
		jobs->peers.jobs_let_go(jobs->peers.user);
	extend_waiting(jobs);
}
