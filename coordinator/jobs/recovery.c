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
#include "coordinator/retention/ages.h"
#include "coordinator/retention/keep.h"
#include "coordinator/store/journal_file.h"

#include <assert.h>
#include <string.h>
#include <time.h>

struct recovery {
	uv_work_t work;
	struct jobs *jobs;
	struct recovering_job **last, *at; /* last: end of the list jobs.found; at: the job being read, NULL: none */
	uint64_t bytes, read;		   /* bytes to read for all jobs; bytes of the jobs that have been read */
	bool under_way;
	int rc; /* result for the job just read */
	struct error error;
};

bool recovery_is_on(const struct jobs *jobs)
{
	return jobs->recovery != NULL;
}

double recovery_share(const struct jobs *jobs)
{
	const struct recovery *r = jobs->recovery;
	uint64_t read = r->read + (r->at ? atomic_load(&r->at->progress.read) : 0);
	return r->bytes > 0 && read < r->bytes ? (double)read / (double)r->bytes : 1;
}

static double share_of(const struct recovering_job *f)
{
	uint64_t read = atomic_load(&f->progress.read);
	return read < f->bytes ? (double)read / (double)f->bytes : 1;
}

static void fill_view(const struct recovering_job *f, struct job_view *v)
{
	view_of_record(v, &f->record);
	v->reading = share_of(f);
	text_copy(v->record.state, sizeof v->record.state, "reading");
	text_print(v->waiting, sizeof v->waiting, "reading, %u %%: its results are read from the spool",
		   (unsigned)(100 * v->reading));
	memcpy(v->owners_waiting, v->waiting, sizeof v->waiting);
}

bool recovery_view(const struct jobs *jobs, uint64_t job, struct job_view *v)
{
	const struct recovering_job *f = jobs->found;
	while (f && f->record.id != job)
		f = f->next;
	if (f)
		fill_view(f, v);
	return f != NULL;
}

size_t recovery_views(const struct jobs *jobs, struct job_view *v)
{
	size_t n = 0;
	for (const struct recovering_job *f = jobs->found; f; f = f->next, n++)
		if (v)
			fill_view(f, &v[n]);
	return n;
}

/* Puts damaged files of a job aside. Its batches can be computed again, with the same bits. Nothing is deleted, since
 * somebody may want to look at the files. Returns -errno if a file is still where it was, and would be read again. */
static int keep_damaged(struct jobs *jobs, struct live_job *job, struct error *e)
{
	char folder[SPOOL_PATH_MAX], path[SPOOL_PATH_MAX], damaged[SPOOL_PATH_MAX];
	spool_job_path(jobs->spool, job->id, NULL, folder);
	spool_job_path(jobs->spool, job->id, "checkpoint", path);
	spool_job_path(jobs->spool, job->id, "checkpoint.damaged", damaged);
	if (disk_rename(path, damaged) && errno != ENOENT)
		return error_file(e, errno, path);
	int rc = journal_keep_damaged(folder, e);
	if (rc)
		return rc;
	live_job_log(job, LOG_SPOOL_FAULT,
		     "text=\"the job starts over; its damaged files are kept in %s as *.damaged\"", folder);
	live_job_log(job, LOG_JOB_STATE, "state=anew");
	return 0;
}

/* Whether this is an error of the stored data and not of the machine, so that it would recur at every start. ENOENT:
 * the folder is missing. */
static bool is_lasting(int rc)
{
	return rc == -EBADMSG || rc == -ERANGE || rc == -ENOENT;
}

static void write_end(struct jobs *jobs, struct job_record *r, const char *why)
{
	struct error e;
	text_copy(r->state, sizeof r->state, "failed");
	text_copy(r->reason, sizeof r->reason, job_end_name(END_FAILED));
	text_copy(r->why, sizeof r->why, why);
	r->exit_code = 3;
	r->ended = (double)time(NULL);
	r->ended_seen = ages_now(jobs);
	log_event(LOG_JOB_FAILED, "job=j%llu text=%s", (unsigned long long)r->id, log_quote(why).text);
	if (ledger_end(jobs->ledger, r, false, &e))
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	ended_jobs_add(jobs, r);
}

/* Fails the job if its error would recur at every start; otherwise returns the error, which is one of the machine. */
static int give_up(struct jobs *jobs, uint64_t id, uint64_t extended, int rc, struct error *e)
{
	struct error why = *e;
	bool there;
	if (!is_lasting(rc))
		return error_prefix(e, rc, "j%llu", (unsigned long long)id);
	struct job_record *r = mem_alloc(1, sizeof *r);
	rc = r ? restore_record(jobs, id, r, &there, e) : error_set(e, ENOMEM, "no memory for the jobs");
	if (!rc && !there)
		record_begin(r, id, "", "");
	if (!rc) {
		r->extended = extended;
		write_end(jobs, r, why.text);
	}
	mem_free(r);
	return rc;
}

static void fail(struct jobs *jobs, int rc, const struct error *e)
{
	jobs->fault = rc;
	jobs->fault_error = *e;
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
static int finish(struct jobs *jobs, struct error *e)
{
	struct recovery *r = jobs->recovery;
	int rc = 0;
	for (struct recovering_job *f; !rc && (f = jobs->found);) {
		struct ledger_job j;
		struct live_job *job = f->job;
		uint64_t id = job->id;
		jobs->found = f->next;
		job->next = jobs->live;
		jobs->live = job;
		mem_free(f);
		rc = ledger_get(jobs->ledger, job->id, &j, e);
		rc = rc > 0   ? restore_tell(jobs, job, j.held, 0, e)
		     : rc < 0 ? rc
			      : error_set(e, ENOENT, "its row is missing");
		if (!rc && (job = jobs_find(jobs, id))) /* the job may have ended at once */
			files_look(jobs, job);
		if (rc)
			rc = error_prefix(e, rc, "j%llu", (unsigned long long)id);
	}
	if (rc)
		return rc;
	mem_free(r);
	jobs->recovery = NULL;
	jobs->changes++;
	uv_idle_start(&jobs->trim, on_trim); /* by now live jobs hold their files */
	keep_trim(jobs);
	jobs->peers.jobs_read(jobs->peers.user);
	return 0;
}

static void read_films(uv_work_t *work)
{
	struct recovery *r = work->data;
	r->rc = replay_films(r->jobs->spool, r->at->job, &r->at->progress, &r->error);
}

static void films_read(uv_work_t *work, int status);

/* Starts to read the next job, or finishes. */
static int read_next(struct jobs *jobs, struct error *e)
{
	struct recovery *r = jobs->recovery;
	if (!r->at)
		return finish(jobs, e);
	r->at->job->film_folder = jobs_film_folder(jobs, &r->at->job->plan);
	r->under_way = true;
	jobs_in_pool(jobs, &r->work, r, read_films, films_read);
	return 0;
}

static void remove_found(struct recovery *r, struct recovering_job *f)
{
	struct recovering_job **at = &r->jobs->found;
	while (*at != f)
		at = &(*at)->next;
	*at = f->next;
	mem_free(f);
}

/* Handles a job that could not be read. Returns 0 if it is to be read again, or has failed for good. */
static int take_failure(struct jobs *jobs, struct error *e)
{
	struct recovery *r = jobs->recovery;
	struct recovering_job *f = r->at;
	struct ledger_job j;
	uint64_t id = f->record.id, extended = f->job->record.extended;
	int rc = r->rc;
	*e = r->error;
	live_job_log(f->job, LOG_SPOOL_FAULT, "text=%s", log_quote(e->text).text);
	bool anew = rc == -EBADMSG && !f->anew;
	if (anew && (rc = keep_damaged(jobs, f->job, e)))
		anew = false;
	restore_drop(jobs, f->job);
	f->job = NULL;
	if (anew) {
		f->anew = true;
		rc = ledger_get(jobs->ledger, id, &j, e);
		rc = rc > 0   ? restore_live_job(jobs, &j, &f->job, e)
		     : rc < 0 ? rc
			      : error_set(e, ENOENT, "its row is missing");
		if (!rc)
			return 0;
	}
	r->at = f->next;
	r->read += f->bytes;
	remove_found(r, f);
	return give_up(jobs, id, extended, rc, e);
}

static void films_read(uv_work_t *work, int status)
{
	struct recovery *r = work->data;
	struct jobs *jobs = r->jobs;
	struct error e;
	int rc = 0;
	assert(status == 0);
	(void)status;
	r->under_way = false;
	if (jobs->stopping)
		return;
	if (r->rc) {
		rc = take_failure(jobs, &e);
	} else {
		r->read += r->at->bytes;
		r->at = r->at->next;
	}
	if (!rc)
		rc = read_next(jobs, &e);
	if (rc)
		fail(jobs, rc, &e);
}

static int add_found(struct jobs *jobs, const struct ledger_job *j, struct error *e)
{
	struct recovery *r = jobs->recovery;
	struct recovering_job *f = mem_alloc(1, sizeof *f);
	if (!f)
		return error_set(e, ENOMEM, "no memory for the jobs");
	uint64_t id = j->id, extended = j->extended;
	int rc = restore_live_job(jobs, j, &f->job, e);
	if (rc) {
		mem_free(f);
		return give_up(jobs, id, extended, rc, e);
	}
	f->record = f->job->record;
	/* Whoever reads the files will meet and report an error; here they only count for the progress. */
	struct error unread;
	spool_film_bytes(jobs->spool, id, 2, &f->bytes, &unread);
	r->bytes += f->bytes;
	*r->last = f;
	r->last = &f->next;
	return 0;
}

int recovery_begin(struct jobs *jobs, struct error *e)
{
	struct ledger_job j;
	struct recovery *r = jobs->recovery = mem_alloc(1, sizeof *r);
	if (!r)
		return error_set(e, ENOMEM, "no memory for the jobs");
	r->jobs = jobs;
	r->last = &jobs->found;
	for (size_t i = 0; i < jobs->restored_count; i++) {
		int rc = ledger_get(jobs->ledger, jobs->restored[i], &j, e);
		if (rc > 0)
			rc = add_found(jobs, &j, e);
		if (rc)
			return rc;
	}
	r->at = jobs->found;
	return read_next(jobs, e);
}

void recovery_stop(struct jobs *jobs)
{
	for (struct recovering_job *f = jobs->found; f; f = f->next)
		atomic_store(&f->progress.stop, true);
}

void recovery_close(struct jobs *jobs)
{
	struct recovery *r = jobs->recovery;
	if (!r)
		return;
	assert(!r->under_way);
	while (jobs->found) {
		struct recovering_job *next = jobs->found->next;
		if (jobs->found->job)
			live_job_free(jobs->found->job);
		mem_free(jobs->found);
		jobs->found = next;
	}
	mem_free(r);
	jobs->recovery = NULL;
}
