/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Checks files of scenes: a queue of files, the first of which is read and hashed by the pool.
 *
 * files_check answers at once for a file that was read within the last FILES_CHECKED_SECONDS seconds, and otherwise
 * puts it into the queue. When the first file has been read, the peers that wait for it are told. If it is damaged, all
 * jobs are looked at: a job that lacks a file is held with the file's name, and one that has all its files is released.
 *
 * A file that cannot be read at the moment is not considered damaged: the jobs that need it have it read again.
 */
#include "coordinator/jobs/files.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/blob/blob_check.h"
#include "coordinator/jobs/step.h"

#include <string.h>

static void set_files_hold(struct jobs *jobs, struct live_job *job, const char *text)
{
	struct event ev = {.kind = EVENT_HOLD, .job = job->id, .hold = HOLD_FILES, .text = text};
	job->has_missing_file = *text != 0;
	live_job_log(job, LOG_JOB_STATE, "state=%s text=%s", *text ? "held" : "released", log_quote(text).text);
	jobs_step(jobs, &ev);
}

/* Returns the first file of the job that the store does not have; NULL: it has all. */
static const Farm__File *find_missing_file(const struct jobs *jobs, const struct live_job *job)
{
	const Farm__Submit *m = live_job_submission(job);
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		if (!blob_is_stored(jobs->blobs, &h, NULL))
			return m->files[i];
	}
	return NULL;
}

bool files_update_hold(struct jobs *jobs, struct live_job *job)
{
	char text[256];
	const Farm__File *f = job->has_ended ? NULL : find_missing_file(jobs, job);
	if (!f == !job->has_missing_file)
		return false;
	*text = 0;
	if (f)
		text_print(
			text, sizeof text,
			"its file %.100s is damaged or missing in the spool: submit the scene again (hslt-submit) to continue",
			f->name);
	set_files_hold(jobs, job, text);
	return true;
}

static void update_all_holds(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live_jobs; job;)
		job = files_update_hold(jobs, job) ? jobs->live_jobs : job->next;
}

/* Files are read some megabytes at a time, so that a large scene does not occupy a thread of the pool for long. */

struct file_check {
	STAILQ_ENTRY(file_check) next; /* only the first one is being read */
	uv_work_t work;
	struct jobs *jobs;
	struct blob_hash hash;
	struct blob_check *check;
	bool has_more;
};

static void read_part(uv_work_t *work)
{
	struct file_check *c = work->data;
	c->has_more = blob_check_read(c->check);
}

static bool needs_file(const struct live_job *job, const struct blob_hash *h)
{
	const Farm__Submit *m = live_job_submission(job);
	for (size_t i = 0; i < m->n_files; i++)
		if (memcmp(m->files[i]->hash.data, h->bytes, BLOB_HASH_SIZE) == 0)
			return true;
	return false;
}

static void on_part_read(uv_work_t *work, int status);

static void read_first_file(struct jobs *jobs)
{
	struct file_check *c = STAILQ_FIRST(&jobs->file_checks);
	if (c)
		jobs_queue_work(jobs, &c->work, c, read_part, on_part_read);
}

/* Ends the check of the first file, and lets those who wait for it continue. */
static void finish_first_check(struct jobs *jobs)
{
	struct file_check *c = STAILQ_FIRST(&jobs->file_checks);
	struct error e = {""};
	int rc = blob_check_end(c->check, &e);
	STAILQ_REMOVE_HEAD(&jobs->file_checks, next);
	read_first_file(jobs);
	if (rc == -EBADMSG)
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	for (struct live_job *job = jobs->live_jobs; rc && job; job = job->next)
		job->has_suspect_files = job->has_suspect_files || needs_file(job, &c->hash);
	if (rc == -EBADMSG)
		update_all_holds(jobs);
	jobs->peers.announce_file_checked(jobs->peers.user, &c->hash, rc, e.text);
	jobs_notify_films_free(jobs); /* failures may have waited for the file */
	mem_free(c);
}

static void drop_checks(struct jobs *jobs)
{
	for (struct file_check *c; (c = STAILQ_FIRST(&jobs->file_checks));) {
		STAILQ_REMOVE_HEAD(&jobs->file_checks, next);
		blob_check_end(c->check, NULL);
		mem_free(c);
	}
}

static void on_part_read(uv_work_t *work, int status)
{
	struct file_check *c = work->data;
	struct jobs *jobs = c->jobs;
	(void)status;
	if (jobs->is_stopping)
		drop_checks(jobs);
	else if (c->has_more)
		read_first_file(jobs);
	else
		finish_first_check(jobs);
}

static int begin_check(struct jobs *jobs, const struct blob_hash *h, double seconds, struct error *e)
{
	if (blob_is_being_checked(jobs->blobs, h))
		return -EINPROGRESS;
	struct file_check *c = mem_alloc(1, sizeof *c);
	if (!c)
		return error_set(e, ENOMEM, "no memory to check a file");
	int rc = blob_check_begin(&c->check, jobs->blobs, h, seconds, e);
	if (rc <= 0) {
		mem_free(c);
		return rc;
	}
	c->jobs = jobs;
	c->hash = *h;
	STAILQ_INSERT_TAIL(&jobs->file_checks, c, next);
	if (c == STAILQ_FIRST(&jobs->file_checks))
		read_first_file(jobs);
	return -EINPROGRESS;
}

int files_check(struct jobs *jobs, const struct blob_hash *h, struct error *e)
{
	int rc = begin_check(jobs, h, FILES_CHECKED_SECONDS, e);
	/* Only if a live job needs the file: a worker may ask for any file, thousands of times a second. */
	if (rc == -ENOENT && blob_is_held(jobs->blobs, h))
		update_all_holds(jobs);
	return rc;
}

bool files_are_being_read(const struct jobs *jobs, const struct live_job *job)
{
	const Farm__Submit *m = live_job_submission(job);
	/* From the end, because the last one is read last. */
	for (size_t i = m->n_files; !STAILQ_EMPTY(&jobs->file_checks) && i-- > 0;) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		if (blob_is_being_checked(jobs->blobs, &h))
			return true;
	}
	return false;
}

void files_reread(struct jobs *jobs, struct live_job *job)
{
	const Farm__Submit *m = live_job_submission(job);
	struct error e;
	bool missing = false;
	job->has_suspect_files = false;
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		int rc = begin_check(jobs, &h, BLOB_SINCE_OPENED, &e);
		missing |= rc == -ENOENT;
		job->has_suspect_files |= rc && rc != -EINPROGRESS;
	}
	if (missing) /* at the end, because the job may be gone afterwards */
		update_all_holds(jobs);
}

bool files_are_intact(const struct jobs *jobs, const struct live_job *job)
{
	return !job->has_suspect_files && !find_missing_file(jobs, job);
}

void files_tick(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live_jobs; job; job = job->next)
		if (job->has_missing_file && files_update_hold(jobs, job))
			return; /* the list may have changed; continue next time */
}
