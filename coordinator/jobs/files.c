/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Checks files of scenes: a queue of files, the first of which is read and hashed by the pool.
 *
 * files_check answers at once for a file that was read within the last FILES_CHECKED seconds, and otherwise puts it
 * into the queue. When the first file has been read, the peers that wait for it are told. If it is damaged, all jobs
 * are looked at: a job that lacks a file is held with the file's name, and one that has all its files is released.
 *
 * A file that cannot be read at the moment is not considered damaged: the jobs that need it have it read again.
 */
#include "coordinator/jobs/files.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/blob/blob_check.h"
#include "coordinator/jobs/step.h"

#include <string.h>

static void hold_job(struct jobs *jobs, struct live_job *job, const char *text)
{
	struct event ev = {.kind = EVENT_HOLD, .job = job->id, .hold = HOLD_FILES, .text = text};
	job->lacks_file = *text != 0;
	live_job_log(job, LOG_JOB_STATE, "state=%s text=%s", *text ? "held" : "released", log_quote(text).text);
	jobs_step(jobs, &ev);
}

/* Returns the first file of the job that the store does not have; NULL: it has all. */
static const Farm__File *find_missing_file(const struct jobs *jobs, const struct live_job *job)
{
	const Farm__Submit *m = live_job_submit(job);
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		if (!blob_has(jobs->blobs, &h, NULL))
			return m->files[i];
	}
	return NULL;
}

bool files_look(struct jobs *jobs, struct live_job *job)
{
	char text[256];
	const Farm__File *f = job->ended ? NULL : find_missing_file(jobs, job);
	if (!f == !job->lacks_file)
		return false;
	*text = 0;
	if (f)
		text_print(
			text, sizeof text,
			"its file %.100s is damaged or missing in the spool: submit the scene again (hslt-submit) to continue",
			f->name);
	hold_job(jobs, job, text);
	return true;
}

static void look_at_all(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live; job;)
		job = files_look(jobs, job) ? jobs->live : job->next;
}

/* Files are read some megabytes at a time, so that a large scene does not occupy a thread of the pool for long. */

struct file_check {
	STAILQ_ENTRY(file_check) next; /* only the first one is being read */
	uv_work_t work;
	struct jobs *jobs;
	struct blob_hash hash;
	struct blob_check *check;
	bool more;
};

static void read_some(uv_work_t *work)
{
	struct file_check *c = work->data;
	c->more = blob_check_read(c->check);
}

static bool needs_file(const struct live_job *job, const struct blob_hash *h)
{
	const Farm__Submit *m = live_job_submit(job);
	for (size_t i = 0; i < m->n_files; i++)
		if (memcmp(m->files[i]->hash.data, h->bytes, BLOB_HASH_SIZE) == 0)
			return true;
	return false;
}

static void on_read(uv_work_t *work, int status);

static void read_first(struct jobs *jobs)
{
	struct file_check *c = STAILQ_FIRST(&jobs->checks);
	if (c)
		jobs_in_pool(jobs, &c->work, c, read_some, on_read);
}

/* Ends the check of the first file, and lets those who wait for it continue. */
static void finish_first(struct jobs *jobs)
{
	struct file_check *c = STAILQ_FIRST(&jobs->checks);
	struct error e = {""};
	int rc = blob_check_end(c->check, &e);
	STAILQ_REMOVE_HEAD(&jobs->checks, next);
	read_first(jobs);
	if (rc == -EBADMSG)
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	for (struct live_job *job = jobs->live; rc && job; job = job->next)
		job->unread = job->unread || needs_file(job, &c->hash);
	if (rc == -EBADMSG)
		look_at_all(jobs);
	jobs->peers.file_read(jobs->peers.user, &c->hash, rc, e.text);
	jobs_films_free(jobs); /* failures may have waited for the file */
	mem_free(c);
}

static void stop(struct jobs *jobs)
{
	for (struct file_check *c; (c = STAILQ_FIRST(&jobs->checks));) {
		STAILQ_REMOVE_HEAD(&jobs->checks, next);
		blob_check_end(c->check, NULL);
		mem_free(c);
	}
}

static void on_read(uv_work_t *work, int status)
{
	struct file_check *c = work->data;
	struct jobs *jobs = c->jobs;
	(void)status;
	if (jobs->stopping)
		stop(jobs);
	else if (c->more)
		read_first(jobs);
	else
		finish_first(jobs);
}

static int check(struct jobs *jobs, const struct blob_hash *h, double seconds, struct error *e)
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
	STAILQ_INSERT_TAIL(&jobs->checks, c, next);
	if (c == STAILQ_FIRST(&jobs->checks))
		read_first(jobs);
	return -EINPROGRESS;
}

int files_check(struct jobs *jobs, const struct blob_hash *h, struct error *e)
{
	int rc = check(jobs, h, FILES_CHECKED, e);
	/* Only if a live job needs the file: a worker may ask for any file, thousands of times a second. */
	if (rc == -ENOENT && blob_is_held(jobs->blobs, h))
		look_at_all(jobs);
	return rc;
}

bool files_are_read(const struct jobs *jobs, const struct live_job *job)
{
	const Farm__Submit *m = live_job_submit(job);
	/* From the end, because the last one is read last. */
	for (size_t i = m->n_files; !STAILQ_EMPTY(&jobs->checks) && i-- > 0;) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		if (blob_is_being_checked(jobs->blobs, &h))
			return true;
	}
	return false;
}

void files_read(struct jobs *jobs, struct live_job *job)
{
	const Farm__Submit *m = live_job_submit(job);
	struct error e;
	bool missing = false;
	job->unread = false;
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		int rc = check(jobs, &h, BLOB_SINCE_GIVEN, &e);
		missing |= rc == -ENOENT;
		job->unread |= rc && rc != -EINPROGRESS;
	}
	if (missing) /* at the end, because the job may be gone afterwards */
		look_at_all(jobs);
}

bool files_are_right(const struct jobs *jobs, const struct live_job *job)
{
	return !job->unread && !find_missing_file(jobs, job);
}

void files_tick(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live; job; job = job->next)
		if (job->lacks_file && files_look(jobs, job))
			return; /* the list may have changed; continue next time */
}
