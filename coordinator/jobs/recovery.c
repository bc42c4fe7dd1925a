/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads the jobs of the last run from the spool.
 *
 * recovery_begin makes a live job from each row of the ledger (restore.c) and lists them. The pool then reads their
 * films, one job after the other (replay.h). After the last one, the core is told of all of them in the order of
 * their ids, they join the live jobs, and requests that arrived meanwhile are served.
 *
 * A job whose checkpoint or journal is damaged is read again without them, so it starts over; the files are kept as
 * *.damaged. A job without folder, plan or scene fails, with the reason in its record. An error of the machine, or a
 * file of another version, stops the coordinator and leaves everything unchanged: the next start may succeed.
 */
#include "coordinator/jobs/recovery.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/jobs/files.h"
#include "coordinator/jobs/restore.h"
#include "coordinator/retention/observed_time.h"
#include "coordinator/retention/kept_films.h"
#include "coordinator/store/journal_file.h"

#include <assert.h>
#include <string.h>
#include <time.h>

struct recovery {
	uv_work_t work;
	struct jobs *jobs;
	/* end of the list jobs.recovering_jobs; the job being read, NULL: none */
	struct recovering_job **tail, *current;
	uint64_t total_bytes, bytes_read; /* bytes to read for all jobs; bytes of the jobs that have been read */
	bool is_reading;
	int rc; /* result for the job just read */
	struct error error;
};

bool recovery_is_running(const struct jobs *jobs)
{
	return jobs->recovery != NULL;
}

double recovery_progress(const struct jobs *jobs)
{
	const struct recovery *r = jobs->recovery;
	uint64_t read = r->bytes_read + (r->current ? atomic_load(&r->current->progress.bytes_read) : 0);
	return r->total_bytes > 0 && read < r->total_bytes ? (double)read / (double)r->total_bytes : 1;
}

static double read_fraction(const struct recovering_job *f)
{
	uint64_t read = atomic_load(&f->progress.bytes_read);
	return read < f->bytes ? (double)read / (double)f->bytes : 1;
}

static void fill_view(const struct recovering_job *f, struct job_view *v)
{
	view_from_record(v, &f->record);
	v->reading = read_fraction(f);
	text_copy(v->record.state, sizeof v->record.state, "reading");
	text_print(v->waiting, sizeof v->waiting, "reading, %u %%: its results are read from the spool",
		   (unsigned)(100 * v->reading));
	memcpy(v->owners_waiting, v->waiting, sizeof v->waiting);
}

bool recovery_get_view(const struct jobs *jobs, uint64_t job, struct job_view *v)
{
	const struct recovering_job *f = jobs->recovering_jobs;
	while (f && f->record.id != job)
		f = f->next;
	if (f)
		fill_view(f, v);
	return f != NULL;
}

size_t recovery_list_views(const struct jobs *jobs, struct job_view *v)
{
	size_t n = 0;
	for (const struct recovering_job *f = jobs->recovering_jobs; f; f = f->next, n++)
		if (v)
			fill_view(f, &v[n]);
	return n;
}

/* Puts damaged files of a job aside. Its batches can be computed again, with the same bits. Nothing is deleted, since
 * somebody may want to look at the files. Returns -errno if a file is still where it was, and would be read again. */
static int set_damaged_aside(struct jobs *jobs, struct live_job *job, struct error *e)
{
	char folder[SPOOL_PATH_MAX], path[SPOOL_PATH_MAX], damaged[SPOOL_PATH_MAX];
	spool_job_path(jobs->spool, job->id, NULL, folder);
	spool_job_path(jobs->spool, job->id, "checkpoint", path);
	spool_job_path(jobs->spool, job->id, "checkpoint.damaged", damaged);
	if (disk_rename(path, damaged) && errno != ENOENT)
		return error_file(e, errno, path);
	int rc = journal_rename_damaged(folder, e);
	if (rc)
		return rc;
	live_job_log(job, LOG_SPOOL_FAULT,
		     "text=\"the job starts over; its damaged files are kept in %s as *.damaged\"", folder);
	live_job_log(job, LOG_JOB_STATE, "state=anew");
	return 0;
}

/* Whether this is an error of the stored data and not of the machine, so that it would recur at every start. ENOENT:
 * the folder is missing. */
static bool is_permanent_error(int rc)
{
	return rc == -EBADMSG || rc == -ERANGE || rc == -ENOENT;
}

static void record_failure(struct jobs *jobs, struct job_record *r, const char *why)
{
	struct error e;
	text_copy(r->state, sizeof r->state, "failed");
	text_copy(r->reason, sizeof r->reason, job_end_name(END_FAILED));
	text_copy(r->why, sizeof r->why, why);
	r->exit_code = 3;
	r->ended = (double)time(NULL);
	r->ended_seen = observed_time_now(jobs);
	log_event(LOG_JOB_FAILED, "job=j%llu text=%s", (unsigned long long)r->id, log_quote(why).text);
	if (ledger_end_job(jobs->ledger, r, false, &e))
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	ended_jobs_add(jobs, r);
}

/* Fails the job if its error would recur at every start; otherwise returns the error, which is one of the machine. */
static int fail_if_permanent(struct jobs *jobs, uint64_t id, uint64_t extended, int rc, struct error *e)
{
	struct error why = *e;
	bool exists;
	if (!is_permanent_error(rc))
		return error_prefix(e, rc, "j%llu", (unsigned long long)id);
	struct job_record *r = mem_alloc(1, sizeof *r);
	rc = r ? restore_record(jobs, id, r, &exists, e) : error_set(e, ENOMEM, "no memory for the jobs");
	if (!rc && !exists)
		record_init(r, id, "", "");
	if (!rc) {
		r->extended = extended;
		record_failure(jobs, r, why.text);
	}
	mem_free(r);
	return rc;
}

static void stop_with_error(struct jobs *jobs, int rc, const struct error *e)
{
	jobs->fatal_code = rc;
	jobs->fatal_error = *e;
	jobs->stop(jobs->stop_user);
}

/* Deletes scene files beyond the limit bit by bit: if --blobs is smaller than before, there may be a million of them.
 */
static void on_trim(uv_idle_t *h)
{
	struct jobs *jobs = h->data;
	if (!blob_store_trim(jobs->blobs))
		uv_idle_stop(h);
}

/* All jobs have been read: tells the core of them, in order. */
static int finish_recovery(struct jobs *jobs, struct error *e)
{
	struct recovery *r = jobs->recovery;
	int rc = 0;
	for (struct recovering_job *f; !rc && (f = jobs->recovering_jobs);) {
		struct ledger_job j;
		struct live_job *job = f->job;
		uint64_t id = job->id;
		jobs->recovering_jobs = f->next;
		job->next = jobs->live_jobs;
		jobs->live_jobs = job;
		mem_free(f);
		rc = ledger_read_row(jobs->ledger, job->id, &j, e);
		rc = rc > 0   ? restore_tell_core(jobs, job, j.holder, 0, e)
		     : rc < 0 ? rc
			      : error_set(e, ENOENT, "its row is missing");
		if (!rc && (job = jobs_find_live(jobs, id))) /* the job may have ended at once */
			files_update_hold(jobs, job);
		if (rc)
			rc = error_prefix(e, rc, "j%llu", (unsigned long long)id);
	}
	if (rc)
		return rc;
	mem_free(r);
	jobs->recovery = NULL;
	jobs->change_count++;
	uv_idle_start(&jobs->trim_idle, on_trim); /* by now live jobs hold their files */
	kept_films_trim(jobs);
	jobs->peers.resume_requests(jobs->peers.user);
	return 0;
}

static void read_films(uv_work_t *work)
{
	struct recovery *r = work->data;
	r->rc = replay_films(r->jobs->spool, r->current->job, &r->current->progress, &r->error);
}

static void on_films_read(uv_work_t *work, int status);

/* Starts to read the next job, or finishes. */
static int read_next(struct jobs *jobs, struct error *e)
{
	struct recovery *r = jobs->recovery;
	if (!r->current)
		return finish_recovery(jobs, e);
	r->current->job->film_folder = jobs_film_folder(jobs, &r->current->job->plan);
	r->is_reading = true;
	jobs_queue_work(jobs, &r->work, r, read_films, on_films_read);
	return 0;
}

static void remove_recovering_job(struct recovery *r, struct recovering_job *f)
{
	struct recovering_job **at = &r->jobs->recovering_jobs;
	while (*at != f)
		at = &(*at)->next;
	*at = f->next;
	mem_free(f);
}

/* Handles a job that could not be read. Returns 0 if it is to be read again, or has failed for good. */
static int handle_failure(struct jobs *jobs, struct error *e)
{
	struct recovery *r = jobs->recovery;
	struct recovering_job *f = r->current;
	struct ledger_job j;
	uint64_t id = f->record.id, extended = f->job->record.extended;
	int rc = r->rc;
	*e = r->error;
	live_job_log(f->job, LOG_SPOOL_FAULT, "text=%s", log_quote(e->text).text);
	bool start_over = rc == -EBADMSG && !f->is_starting_over;
	if (start_over && (rc = set_damaged_aside(jobs, f->job, e)))
		start_over = false;
	restore_drop_job(jobs, f->job);
	f->job = NULL;
	if (start_over) {
		f->is_starting_over = true;
		rc = ledger_read_row(jobs->ledger, id, &j, e);
		rc = rc > 0   ? restore_live_job(jobs, &j, &f->job, e)
		     : rc < 0 ? rc
			      : error_set(e, ENOENT, "its row is missing");
		if (!rc)
			return 0;
	}
	r->current = f->next;
	r->bytes_read += f->bytes;
	remove_recovering_job(r, f);
	return fail_if_permanent(jobs, id, extended, rc, e);
}

static void on_films_read(uv_work_t *work, int status)
{
	struct recovery *r = work->data;
	struct jobs *jobs = r->jobs;
	struct error e;
	int rc = 0;
	assert(status == 0);
	(void)status;
	r->is_reading = false;
	if (jobs->is_stopping)
		return;
	if (r->rc) {
		rc = handle_failure(jobs, &e);
	} else {
		r->bytes_read += r->current->bytes;
		r->current = r->current->next;
	}
	if (!rc)
		rc = read_next(jobs, &e);
	if (rc)
		stop_with_error(jobs, rc, &e);
}

static int add_recovering_job(struct jobs *jobs, const struct ledger_job *j, struct error *e)
{
	struct recovery *r = jobs->recovery;
	struct recovering_job *f = mem_alloc(1, sizeof *f);
	if (!f)
		return error_set(e, ENOMEM, "no memory for the jobs");
	uint64_t id = j->id, extended = j->extended;
	int rc = restore_live_job(jobs, j, &f->job, e);
	if (rc) {
		mem_free(f);
		return fail_if_permanent(jobs, id, extended, rc, e);
	}
	f->record = f->job->record;
	/* Whoever reads the files will meet and report an error; here they only count for the progress. */
	struct error ignored;
	spool_film_bytes(jobs->spool, id, 2, &f->bytes, &ignored);
	r->total_bytes += f->bytes;
	*r->tail = f;
	r->tail = &f->next;
	return 0;
}

int recovery_begin(struct jobs *jobs, struct error *e)
{
	struct ledger_job j;
	struct recovery *r = jobs->recovery = mem_alloc(1, sizeof *r);
	if (!r)
		return error_set(e, ENOMEM, "no memory for the jobs");
	r->jobs = jobs;
	r->tail = &jobs->recovering_jobs;
	for (size_t i = 0; i < jobs->restored_count; i++) {
		int rc = ledger_read_row(jobs->ledger, jobs->restored_ids[i], &j, e);
		if (rc > 0)
			rc = add_recovering_job(jobs, &j, e);
		if (rc)
			return rc;
	}
	r->current = jobs->recovering_jobs;
	return read_next(jobs, e);
}

void recovery_stop(struct jobs *jobs)
{
	for (struct recovering_job *f = jobs->recovering_jobs; f; f = f->next)
		atomic_store(&f->progress.stop_requested, true);
}

void recovery_close(struct jobs *jobs)
{
	struct recovery *r = jobs->recovery;
	if (!r)
		return;
	assert(!r->is_reading);
	while (jobs->recovering_jobs) {
		struct recovering_job *next = jobs->recovering_jobs->next;
		if (jobs->recovering_jobs->job)
			live_job_free(jobs->recovering_jobs->job);
		mem_free(jobs->recovering_jobs);
		jobs->recovering_jobs = next;
	}
	mem_free(r);
	jobs->recovery = NULL;
}
