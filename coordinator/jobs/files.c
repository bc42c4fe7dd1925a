/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/files.h"

#include "common/base/text.h"
#include "coordinator/jobs/step.h"

#include <string.h>

static void hold(struct jobs *jobs, struct live_job *job, const char *text)
{
	struct event ev = {.kind = EVENT_HOLD, .job = job->id, .hold = HOLD_FILES, .text = text};
	job->lacks_file = *text != 0;
	live_job_log(job, LOG_JOB_STATE, "state=%s text=%s", *text ? "held" : "released", log_quote(text).text);
	jobs_step(jobs, &ev);
}

/* The first missing one; NULL: all exist. */
static const Farm__File *lacking(const struct jobs *jobs, const struct live_job *job)
{
	const Farm__Submit *m = live_job_submit(job);
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = live_job_file_hash(m->files[i]);
		if (!blob_has(jobs->blobs, &h, NULL))
			return m->files[i];
	}
	return NULL;
}

/* Holds or releases it for its files. true: a step was made, after which any job may be gone. */
static bool look(struct jobs *jobs, struct live_job *job)
{
	char text[256];
	const Farm__File *f = job->ended ? NULL : lacking(jobs, job);
	if (!f == !job->lacks_file)
		return false;
	*text = 0;
	if (f)
		text_print(
			text, sizeof text,
			"its file %.100s is damaged or missing in the spool: submit the scene again (hslt-submit) to continue",
			f->name);
	hold(jobs, job, text);
	return true;
}

void files_look(struct jobs *jobs, struct live_job *job)
{
	look(jobs, job);
}

static void look_at_all(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live; job;)
		job = look(jobs, job) ? jobs->live : job->next;
}

/* -EBADMSG, -ENOENT: the jobs that need it are to wait. */
static int verify(struct jobs *jobs, const struct blob_hash *h, double seconds, struct error *e)
{
	int rc = blob_check(jobs->blobs, h, seconds, e);
	if (rc == -EBADMSG)
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e->text).text);
	return rc;
}

int files_check(struct jobs *jobs, const struct blob_hash *h, double seconds, struct error *e)
{
	int rc = verify(jobs, h, seconds, e);
	if (rc == -EBADMSG || rc == -ENOENT)
		look_at_all(jobs);
	return rc;
}

bool files_are_right(struct jobs *jobs, const struct live_job *job)
{
	const Farm__Submit *m = live_job_submit(job);
	struct error e;
	bool right = true;
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = live_job_file_hash(m->files[i]);
		right = verify(jobs, &h, BLOB_SINCE_GIVEN, &e) == 0 && right;
	}
	if (!right) /* last: the job may be gone afterwards */
		look_at_all(jobs);
	return right;
}

void files_tick(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live; job; job = job->next)
		if (job->lacks_file && look(jobs, job))
			return; /* the list may have changed; continue next time */
}
