/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The end of a live job. A job that the core has ended is finished as soon as no thread reads its films: its record
 * is written and its row ended (durable.h), workers are told, its memory is freed. If the disk refuses the record,
 * finishing is tried again (lifecycle.c), and until then the job counts as running.
 */
#include "coordinator/jobs/finish.h"

#include "common/base/clock.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/extend.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/results.h"
#include "coordinator/retention/observed_time.h"
#include "coordinator/retention/clearing.h"
#include "coordinator/retention/kept_films.h"

static struct job_record final_record(const struct jobs *jobs, const struct live_job *job)
{
	struct job_view v;
	jobs_get_end_view(jobs, job, &v);
	v.record.ended_seen = observed_time_now(jobs);
	if (!v.record.cut)
		v.record.ended = clock_wall_seconds();
	return v.record;
}

static void finish_job(struct jobs *jobs, struct live_job *job)
{
	job->record = final_record(jobs, job);
	if (durable_end_job(jobs, job)) { /* lifecycle.c tries again */
		job->is_record_pending = true;
		job->retry_at = jobs_now(jobs) + jobs->config.retry_seconds;
		return;
	}
	ended_jobs_add(jobs, &job->record);
	jobs->peers.announce_job_end(jobs->peers.user, job->id);
	kept_films_trim(jobs);
	clearing_schedule_soon(jobs);
	live_job_release_blobs(live_job_submission(job), jobs->blobs);
	struct live_job **at = &jobs->live_jobs;
	while (*at != job)
		at = &(*at)->next;
	*at = job->next;
	struct waiting_list late = STAILQ_HEAD_INITIALIZER(late);
	STAILQ_CONCAT(&late, &job->waiting_messages);
	live_job_free(job);
	for (struct waiting_message *w; (w = STAILQ_FIRST(&late));) { /* the core refuses them, since the job is over */
		STAILQ_REMOVE_HEAD(&late, next);
		results_handle_waiting(jobs, w);
		waiting_message_free(w);
	}
}

int finish_check_cancelled(struct jobs *jobs, uint64_t id, struct error *e)
{
	struct live_job *job = jobs_find_live(jobs, id);
	if (!job)
		return durable_check_ended(jobs, id, e);
	if (!job->has_ended)
		return 0;
	struct job_record r = final_record(jobs, job);
	return durable_end_early(jobs, job, &r, e);
}

void finish_ended(struct jobs *jobs)
{
	bool finished = false;
	for (struct live_job *job = jobs->live_jobs, *next; job; job = next) {
		next = job->next;
		if (job->has_ended && !job->is_busy && !job->is_publish_pending && !job->is_record_pending) {
			finish_job(jobs, job);
			finished = true;
			next = jobs->live_jobs; /* results that waited may have ended other jobs */
		}
	}
	if (finished)
		jobs->peers.release_watchers(jobs->peers.user);
	extend_handle_waiting(jobs);
}
