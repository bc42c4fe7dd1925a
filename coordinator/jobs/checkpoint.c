/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Checkpoints: films, seeds, chain states and counters of a job in one file, so that its journal can start over.
 *
 * checkpoint_where_due starts a checkpoint when a job's journal has grown beyond the limit of room_for_journal, one
 * job at a time. The thread pool writes the next journal (with the last results of each group and part, which may
 * still have to be taken back), then checkpoint.tmp, flushes it, renames it to checkpoint and flushes the folder.
 * Results that arrive meanwhile wait in memory. Then the new journal is used and older ones are deleted.
 *
 * If writing fails, the old checkpoint and journal stay in use, and another attempt follows after a pause. If only
 * the flush of the folder fails, it is unknown which of the two pairs a crash would leave; both contain everything
 * acknowledged, and the job is held until a checkpoint succeeds. A checkpoint that is damaged when it is read makes
 * its job start over.
 */
#include "coordinator/jobs/checkpoint.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/live_job/rollback.h"
#include "coordinator/live_job/checkpoint_file.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/room.h"
#include "coordinator/jobs/step.h"
#include "coordinator/store/journal_file.h"

#include <assert.h>
#include <stdio.h>

static const double pause_seconds = 30; /* after a failed attempt */

struct writing {
	uv_work_t work;
	struct jobs *jobs;
	struct live_job *job;
	struct journal *journal; /* the next journal */
	struct checkpoint_head head;
	uint64_t bytes, kept_most;
	struct merged_record *merged; /* records copied into the next journal */
	size_t merged_count;
	char folder[SPOOL_PATH_MAX];
	int rc;
	bool unsure; /* the checkpoint was renamed, but perhaps not durably */
	struct error error;
};

static void write_checkpoint(uv_work_t *work)
{
	struct writing *w = work->data;
	struct checked_file out = {0};
	char name[SPOOL_PATH_MAX + 16], temporary[SPOOL_PATH_MAX + 16];
	snprintf(name, sizeof name, "%s/checkpoint", w->folder);
	snprintf(temporary, sizeof temporary, "%s/checkpoint.tmp", w->folder);
	w->rc = journal_create(&w->journal, w->folder, w->head.job, w->head.generation, &w->error);
	if (!w->rc)
		rollback_copy(w->job, w->journal, w->kept_most, &w->merged, &w->merged_count);
	if (!w->rc)
		w->rc = checked_file_create(&out, temporary, &w->error);
	if (!w->rc)
		w->rc = checkpoint_write(w->job, &w->head, &out, &w->error);
	if (!w->rc)
		w->rc = checked_file_finish(&out, &w->error);
	checked_file_close(&out);
	w->bytes = out.bytes;
	if (!w->rc)
		w->rc = disk_rename(temporary, name) ? error_file(&w->error, errno, name) : 0;
	if (!w->rc) {
		w->rc = disk_sync_folder(w->folder, &w->error);
		w->unsure = w->rc != 0;
	}
	if (w->rc) {
		if (!w->unsure)
			disk_unlink(temporary);
		journal_release(w->journal);
		w->journal = NULL;
	}
}

/* Closing and deleting a journal of hundreds of megabytes takes hundreds of milliseconds, so the pool does it. */
struct tidying {
	uv_work_t work;
	struct jobs *jobs;
	struct journal *old;
	uint64_t keep;
	char folder[SPOOL_PATH_MAX];
};

static void run_tidy(uv_work_t *work)
{
	struct tidying *t = work->data;
	journal_release(t->old); /* acknowledgements that wait for its flush also hold references */
	journal_clear(t->folder, t->keep);
}

static void on_tidied(uv_work_t *work, int status)
{
	struct tidying *t = work->data;
	(void)status;
	t->jobs->checkpointing = false; /* not earlier, so that journal_clear cannot meet a newer journal */
	mem_free(t);
}

/* Deletes all journals but that of generation `keep`. */
static void delete_old_journals(struct jobs *jobs, struct journal *old, const char *folder, uint64_t keep)
{
	struct tidying *t = mem_alloc(1, sizeof *t);
	if (!t) {
		journal_release(old);
		journal_clear(folder, keep);
		jobs->checkpointing = false;
		return;
	}
	*t = (struct tidying){.jobs = jobs, .old = old, .keep = keep};
	snprintf(t->folder, sizeof t->folder, "%s", folder);
	jobs_in_pool(jobs, &t->work, t, run_tidy, on_tidied);
}

static void checkpoint_written(uv_work_t *work, int status)
{
	struct writing *w = work->data;
	struct jobs *jobs = w->jobs;
	struct live_job *job = w->job;
	uint64_t id = job->id;
	assert(status == 0);
	(void)status;
	/* A crash may leave this checkpoint with its journal, or the old pair; both contain everything acknowledged. */
	if (w->rc && (w->unsure || job->unsure)) {
		job->unsure = true;
		job->generation_least = w->head.generation + 1;
		job->checkpoint_after = jobs_now(jobs) + jobs->config.retry_seconds;
	} else if (w->rc) { /* the old checkpoint and journal stay in use */
		live_job_log(job, LOG_SPOOL_FAULT, "text=%s", log_quote(w->error.text).text);
		bool room = disk_is_full(w->rc) && room_make(jobs);
		job->checkpoint_after = jobs_now(jobs) + (room ? jobs->config.retry_seconds : pause_seconds);
		journal_clear(w->folder, journal_generation(job->journal));
	} else {
		job->unsure = false;
		journal_settle(job->journal);
		log_event(LOG_CHECKPOINT, "job=j%llu rounds=%llu bytes=%llu journal=%llu", (unsigned long long)id,
			  (unsigned long long)canvas_rounds(job->canvas), (unsigned long long)w->bytes,
			  (unsigned long long)journal_bytes(job->journal));
		delete_old_journals(jobs, job->journal, w->folder, w->head.generation);
		job->journal = w->journal;
		job->checkpoint_bytes = w->bytes;
		mem_free(job->merged);
		job->merged = w->merged;
		job->merged_count = w->merged_count;
		job->kept_bytes = journal_bytes(job->journal);
		w->merged = NULL;
	}
	mem_free(w->merged);
	job->busy = false;
	jobs->checkpointing = jobs->checkpointing && !w->rc;
	/* This ends the job at once if it was cancelled. */
	if (!jobs->stopping && job->unsure)
		durable_hold(jobs, job, "its results cannot be stored", w->error.text);
	if (!jobs->stopping) {
		jobs_films_free(jobs);
		jobs->peers.films_free(jobs->peers.user, id);
	}
	mem_free(w);
}

/* Starts a checkpoint. most: limit on the bytes of results copied into the next journal. */
static void start(struct jobs *jobs, struct live_job *job, uint64_t most)
{
	struct job_status status;
	struct writing *w = mem_alloc(1, sizeof *w);
	if (!w || !farm_job(jobs->farm, job->id, jobs_now(jobs), &status)) {
		mem_free(w);
		job->checkpoint_after = jobs_now(jobs) + pause_seconds;
		return;
	}
	w->jobs = jobs;
	w->job = job;
	w->kept_most = most;
	spool_job_path(jobs->spool, job->id, NULL, w->folder);
	checkpoint_head_of(&w->head, job, &status);
	job->busy = jobs->checkpointing = true;
	jobs_in_pool(jobs, &w->work, w, write_checkpoint, checkpoint_written);
}

void checkpoint_where_due(struct jobs *jobs)
{
	/* One at a time, because the results of its job wait in memory meanwhile. */
	if (jobs->stepping || jobs->stopping || jobs->checkpointing)
		return;
	const bool ample = room_is_ample(jobs);
	for (struct live_job *job = jobs->live; job; job = job->next) {
		/* Stored results that wait (late.h) exist only in the journal. */
		if (!job->canvas || job->busy || job->ended || job->late_count)
			continue;
		if (canvas_missing(job->canvas)) /* a batch that was taken back is being computed again */
			continue;
		uint64_t limit = room_for_journal(jobs, job, ample);
		if ((journal_bytes(job->journal) - job->kept_bytes > limit || job->unsure) &&
		    jobs_now(jobs) >= job->checkpoint_after)
			start(jobs, job, limit);
		if (jobs->checkpointing)
			return;
	}
}
