/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The end of a live job. One that the core has ended is finished as soon as no thread reads its films: its record is
 * written and its row ended (durable.h), workers are told, its memory is freed. A record that the disk does not take is
 * tried again (retry.c), and until then the job counts as running.
 */
#include "coordinator/jobs/finish.h"

#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/ended_jobs.h"
#include "coordinator/jobs/extend.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/results.h"
#include "coordinator/retention/ages.h"
#include "coordinator/retention/clear.h"
#include "coordinator/retention/keep.h"

#include <time.h>

static void finish(struct jobs *s, struct live_job *job)
{
	struct job_view v;
	struct timespec now;
	clock_gettime(CLOCK_REALTIME, &now);
	jobs_view(s, job->id, &v);
	v.record.ended_seen = ages_now(s);
	v.record.ended = (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
	job->record = v.record;
	if (durable_end(s, job)) { /* again, later */
		job->unrecorded = true;
		job->try_again = jobs_now(s) + s->config.retry_seconds;
		return;
	}
	ended_jobs_add(s, &v.record);
	s->peers.job_ended(s->peers.user, job->id);
	keep_trim(s);
	clear_soon(s);
	live_job_release_blobs(live_job_submit(job), s->blobs);
	struct live_job **at = &s->live;
	while (*at != job)
		at = &(*at)->next;
	*at = job->next;
	struct waiting_batch *late = job->waiting;
	job->waiting = NULL;
	job->waiting_last = &job->waiting;
	live_job_free(job);
	while (late) { /* the core says that the job is over */
		struct waiting_batch *next = late->next;
		results_take(s, late->peer, &late->envelope, &late->payload);
		waiting_batch_free(late);
		late = next;
	}
}

void finish_ended(struct jobs *s)
{
	bool finished = false;
	for (struct live_job *job = s->live, *next; job; job = next) {
		next = job->next;
		if (job->ended && !job->busy && !job->unpublished && !job->unrecorded) {
			finish(s, job);
			finished = true;
			next = s->live; /* late batches may have ended others */
		}
	}
	if (finished)
		s->peers.jobs_let_go(s->peers.user);
	extend_waiting(s);
}
