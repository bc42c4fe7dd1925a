/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Checkpoints: films, seeds, chain states and counters of a job in one file, so that its journal can start over.
 *
 * checkpoint_start_due starts a checkpoint when a job's journal has grown beyond the limit of storage_journal_limit,
 * one job at a time. The thread pool writes the next journal (with the last results of each group and part, which may
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
#include "coordinator/jobs/storage.h"
#include "coordinator/jobs/step.h"
#include "coordinator/store/journal_file.h"

#include <assert.h>
#include <stdio.h>

static const double retry_pause_seconds = 30; /* after a failed attempt */

struct checkpoint_task {
	uv_work_t work;
	struct jobs *jobs;
	struct live_job *job;
	struct journal *journal; /* the next journal */
	struct checkpoint_head head;
	uint64_t bytes, max_kept_bytes;
	struct merged_record *merged_records; /* records copied into the next journal */
	size_t merged_record_count;
	char folder[SPOOL_PATH_MAX];
	int rc;
	bool is_rename_uncertain; /* the checkpoint was renamed, but perhaps not durably */
	struct error error;
};

static void write_checkpoint(uv_work_t *work)
{
	struct checkpoint_task *w = work->data;
	struct checked_file out = {0};
	char name[SPOOL_PATH_MAX + 16], temporary[SPOOL_PATH_MAX + 16];
	snprintf(name, sizeof name, "%s/checkpoint", w->folder);
	snprintf(temporary, sizeof temporary, "%s/checkpoint.tmp", w->folder);
	w->rc = journal_create(&w->journal, w->folder, w->head.job, w->head.generation, &w->error);
	if (!w->rc)
		rollback_copy_records(w->job, w->journal, w->max_kept_bytes, &w->merged_records,
				      &w->merged_record_count);
	if (!w->rc)
		w->rc = checked_file_create(&out, temporary, &w->error);
	if (!w->rc)
		w->rc = checkpoint_write(w->job, &w->head, &out, &w->error);
	if (!w->rc)
		w->rc = checked_file_finish(&out, &w->error);
	checked_file_close(&out);
	w->bytes = out.bytes_written;
	if (!w->rc)
		w->rc = disk_rename(temporary, name) ? error_file(&w->error, errno, name) : 0;
	if (!w->rc) {
		w->rc = disk_sync_folder(w->folder, &w->error);
		w->is_rename_uncertain = w->rc != 0;
	}
	if (w->rc) {
		if (!w->is_rename_uncertain)
			disk_unlink(temporary);
		journal_release(w->journal);
		w->journal = NULL;
	}
}

/* Closing and deleting a journal of hundreds of megabytes takes hundreds of milliseconds, so the pool does it. */
struct journal_cleanup {
	uv_work_t work;
	struct jobs *jobs;
	struct journal *old_journal;
	uint64_t kept_generation;
	char folder[SPOOL_PATH_MAX];
};

static void run_cleanup(uv_work_t *work)
{
	struct journal_cleanup *t = work->data;
	journal_release(t->old_journal); /* acknowledgements that wait for its flush also hold references */
	journal_delete_others(t->folder, t->kept_generation);
}

static void on_cleanup_done(uv_work_t *work, int status)
{
	struct journal_cleanup *t = work->data;
	(void)status;
	t->jobs->is_checkpointing = false; /* not earlier, so that journal_delete_others cannot meet a newer journal */
	mem_free(t);
}

/* Deletes all journals but that of generation `kept_generation`. */
static void delete_old_journals(struct jobs *jobs, struct journal *old, const char *folder, uint64_t kept_generation)
{
	struct journal_cleanup *t = mem_alloc(1, sizeof *t);
	if (!t) {
		journal_release(old);
		journal_delete_others(folder, kept_generation);
		jobs->is_checkpointing = false;
		return;
	}
	*t = (struct journal_cleanup){.jobs = jobs, .old_journal = old, .kept_generation = kept_generation};
	snprintf(t->folder, sizeof t->folder, "%s", folder);
	jobs_queue_work(jobs, &t->work, t, run_cleanup, on_cleanup_done);
}

static void on_checkpoint_written(uv_work_t *work, int status)
{
	struct checkpoint_task *w = work->data;
	struct jobs *jobs = w->jobs;
	struct live_job *job = w->job;
	uint64_t id = job->id;
	assert(status == 0);
	(void)status;
	/* A crash may leave this checkpoint with its journal, or the old pair; both contain everything acknowledged. */
	if (w->rc && (w->is_rename_uncertain || job->is_checkpoint_uncertain)) {
		job->is_checkpoint_uncertain = true;
		job->min_generation = w->head.generation + 1;
		job->min_checkpoint_time = jobs_now(jobs) + jobs->config.retry_seconds;
	} else if (w->rc) { /* the old checkpoint and journal stay in use */
		live_job_log(job, LOG_SPOOL_FAULT, "text=%s", log_quote(w->error.text).text);
		bool room = disk_is_full(w->rc) && storage_evict(jobs);
		job->min_checkpoint_time = jobs_now(jobs) + (room ? jobs->config.retry_seconds : retry_pause_seconds);
		journal_delete_others(w->folder, journal_generation(job->journal));
	} else {
		job->is_checkpoint_uncertain = false;
		journal_mark_settled(job->journal);
		log_event(LOG_CHECKPOINT, "job=j%llu rounds=%llu bytes=%llu journal=%llu", (unsigned long long)id,
			  (unsigned long long)canvas_complete_rounds(job->canvas), (unsigned long long)w->bytes,
			  (unsigned long long)journal_bytes(job->journal));
		delete_old_journals(jobs, job->journal, w->folder, w->head.generation);
		job->journal = w->journal;
		job->checkpoint_bytes = w->bytes;
		mem_free(job->merged_records);
		job->merged_records = w->merged_records;
		job->merged_record_count = w->merged_record_count;
		job->merged_record_bytes = journal_bytes(job->journal);
		w->merged_records = NULL;
	}
	mem_free(w->merged_records);
	job->is_busy = false;
	jobs->is_checkpointing = jobs->is_checkpointing && !w->rc;
	/* This ends the job at once if it was cancelled. */
	if (!jobs->is_stopping && job->is_checkpoint_uncertain)
		durable_hold_job(jobs, job, "its results cannot be stored", w->error.text);
	if (!jobs->is_stopping) {
		jobs_notify_films_free(jobs);
		jobs->peers.serve_previews(jobs->peers.user, id);
	}
	mem_free(w);
}

/* Starts a checkpoint. max_kept_bytes: limit on the bytes of results copied into the next journal. */
static void start_checkpoint(struct jobs *jobs, struct live_job *job, uint64_t max_kept_bytes)
{
	struct job_status status;
	struct checkpoint_task *w = mem_alloc(1, sizeof *w);
	if (!w || !farm_job_status(jobs->farm, job->id, jobs_now(jobs), &status)) {
		mem_free(w);
		job->min_checkpoint_time = jobs_now(jobs) + retry_pause_seconds;
		return;
	}
	w->jobs = jobs;
	w->job = job;
	w->max_kept_bytes = max_kept_bytes;
	spool_job_path(jobs->spool, job->id, NULL, w->folder);
	checkpoint_head_fill(&w->head, job, &status);
	job->is_busy = jobs->is_checkpointing = true;
	jobs_queue_work(jobs, &w->work, w, write_checkpoint, on_checkpoint_written);
}

void checkpoint_start_due(struct jobs *jobs)
{
	/* One at a time, because the results of its job wait in memory meanwhile. */
	if (jobs->is_stepping || jobs->is_stopping || jobs->is_checkpointing)
		return;
	const bool ample = storage_is_ample(jobs);
	for (struct live_job *job = jobs->live_jobs; job; job = job->next) {
		/* Stored results that wait (late_results.h) exist only in the journal. */
		if (!job->canvas || job->is_busy || job->has_ended || job->late_result_count)
			continue;
		if (canvas_missing_count(job->canvas)) /* a batch that was taken back is being computed again */
			continue;
		uint64_t limit = storage_journal_limit(jobs, job, ample);
		if ((journal_bytes(job->journal) - job->merged_record_bytes > limit || job->is_checkpoint_uncertain) &&
		    jobs_now(jobs) >= job->min_checkpoint_time)
			start_checkpoint(jobs, job, limit);
		if (jobs->is_checkpointing)
			return;
	}
}
