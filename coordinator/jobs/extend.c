/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Extensions of jobs: a list of requests until they are answered.
 *
 * extend_job appends a request; extend_handle_waiting handles those whose jobs are not in use. A live job gets its new
 * plan in the ledger and then in the core. A finished job is read from its kept films (kept_films.h) by a thread of the
 * pool, one job at a time, and continues as after a restart.
 *
 * Each request is answered once, unless its peer is gone; a job that was read for that peer is then dropped. A
 * request that cannot be fulfilled is answered with a sentence, and the job stays as it was.
 */
#include "coordinator/jobs/extend.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/restore.h"
#include "coordinator/jobs/storage.h"
#include "coordinator/jobs/step.h"
#include "coordinator/retention/kept_films.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static const char *const resubmit_hint = "submit it again with hslt-submit";

static double last_error(const struct forecast_history *h)
{
	return h->count && !h->looks[h->count - 1].is_doubtful ? sqrt(h->looks[h->count - 1].rel_mse_upper) : NAN;
}

/* r: the record of the job's end; NULL: it is live. */
static struct extension_basis extension_from_job(const struct live_job *job, double seconds, const struct job_record *r)
{
	return (struct extension_basis){.rounds = live_job_complete_rounds(job),
					.seconds = seconds,
					.error = last_error(&job->record.looks),
					.has_ended = r != NULL,
					.was_extension_cancelled = r && r->cut};
}

static int make_plan(const struct jobs *jobs, const struct requester *requester, const struct live_job *job,
		     const struct extension *x, const struct extension_basis *basis, struct plan_request *request,
		     struct plan *plan, struct error *e)
{
	int rc = plan_request_from_wire(live_job_submission(job)->plan, request, e);
	if (!rc)
		rc = extend_plan(&job->plan, x, basis, request, plan, e);
	if (rc || requester->is_exempt_from_quota)
		return rc;
	return jobs_check_quota(jobs, requester->owner, job->id,
				jobs->peers.uploading_bytes(jobs->peers.user, requester->peer), plan,
				live_job_submission(job), e);
}

static void set_bounds(struct live_job *job, const struct plan_request *request, const struct plan *plan)
{
	Farm__PlanRequest *r = job->submission.message->submit->plan;
	r->spp = request->spp;
	r->mutations = request->mutations;
	r->seconds = request->seconds;
	r->target_error = request->target_error;
	job->plan = *plan;
	job->record.target_error = plan->target_error;
	if (job->canvas)
		canvas_set_rounds(job->canvas, plan->rounds);
}

static int store_bounds(struct jobs *jobs, const struct live_job *job, struct error *e)
{
	struct ledger_job j = {.id = job->id, .extended = job->record.extended};
	unsigned char *submission, *plan;
	int rc = durable_pack_job(job, &j, &submission, &plan, e);
	if (!rc)
		rc = ledger_extend_job(jobs->ledger, &j, e);
	mem_free(submission);
	mem_free(plan);
	return rc;
}

/* Describes the job's bounds, for its log and for the client. */
static void describe_bounds(const struct live_job *job, char *text, size_t size)
{
	struct text t = {text, size};
	const char *comma = "";
	uint64_t rounds = live_job_complete_rounds(job);
	text_appendf(&t, "continues after %llu round%s, until", (unsigned long long)rounds, rounds == 1 ? "" : "s");
	if (job->plan.rounds != UINT64_MAX) {
		text_appendf(&t, " %llu are done", (unsigned long long)job->plan.rounds);
		comma = " or";
	}
	if (job->plan.seconds > 0) {
		text_appendf(&t, "%s %.3g s are over", comma, job->plan.seconds);
		comma = " or";
	}
	if (job->plan.target_error > 0)
		text_appendf(&t, "%s its error is %.3g %%", comma, 100 * job->plan.target_error);
}

static void log_extension(const struct requester *requester, struct live_job *job, char *text, size_t size)
{
	describe_bounds(job, text, size);
	live_job_log(job, LOG_JOB_STATE, "state=extended by=%s text=%s", *requester->owner ? requester->owner : "-",
		     log_quote(text).text);
}

static int extend_live(struct jobs *jobs, const struct requester *requester, struct live_job *job,
		       const struct extension *x, char *text, size_t size, struct error *e)
{
	struct plan_request request, old_asked;
	struct plan plan, old = job->plan;
	double seconds = farm_job_elapsed(jobs->farm, job->id, jobs_now(jobs));
	struct extension_basis basis = extension_from_job(job, isnan(seconds) ? 0 : seconds, NULL);
	int rc = plan_request_from_wire(live_job_submission(job)->plan, &old_asked, e);
	if (!rc)
		rc = make_plan(jobs, requester, job, x, &basis, &request, &plan, e);
	if (rc)
		return rc;
	set_bounds(job, &request, &plan);
	rc = store_bounds(jobs, job, e);
	if (rc) {
		set_bounds(job, &old_asked, &old);
		return rc;
	}
	log_extension(requester, job, text, size);
	struct event ev = {.kind = EVENT_EXTEND, .tag = requester->peer, .job = job->id, .plan = &job->plan};
	return jobs_try_step(jobs, &ev, &(struct incoming){0}, e);
}

/* Reads the job's row. Returns -ENOENT if its films have been deleted. */
static int read_row(const struct jobs *jobs, uint64_t job, struct ledger_job *j, struct error *e)
{
	int rc = ledger_read_row(jobs->ledger, job, j, e);
	uint64_t bytes = 0;
	if (rc > 0 && j->submission_size)
		rc = spool_film_bytes(jobs->spool, job, 1, &bytes, e);
	if (rc < 0)
		return error_prefix(e, rc, "what was kept of it");
	return bytes ? 0 : error_set(e, ENOENT, "its films have been deleted: %s", resubmit_hint);
}

/* Takes the counters of the record, which are from the very end, where they are higher than those of the journal. */
static void raise_counts(struct job_counts *c, const struct job_record *r)
{
#define COUNTER(member, key, wire)        \
	if (c->member < r->counts.member) \
		c->member = r->counts.member;
	JOB_COUNTERS(COUNTER)
#undef COUNTER
}

/* Makes the job live again. r: the record of its end. */
static int resume_job(struct jobs *jobs, const struct requester *requester, struct live_job *job,
		      const struct job_record *r, struct error *e)
{
	job->record.extended++;
	int rc = store_bounds(jobs, job, e);
	if (rc)
		return rc;
	job->record.has_result = r->has_result;
	raise_counts(&job->record.counts, r);
	job->next = jobs->live_jobs;
	jobs->live_jobs = job;
	ended_jobs_remove(jobs, job->id);
	rc = restore_tell_core(jobs, job, "", requester->peer, e);
	if (!rc)
		return 0;
	jobs->live_jobs = job->next;
	ended_jobs_add(jobs, r);
	struct job_record ended_record = *r;
	ended_record.extended = job->record.extended;
	durable_restore_end(jobs, &ended_record);
	return rc;
}

/* Explains why the films cannot be read: a full disk may have room later; otherwise the films are of no more use. */
static int cannot_continue_error(int rc, struct error *e)
{
	return error_prefix(e, rc, "it cannot continue: %s",
			    disk_is_full(rc) ? "extend it when the disk has room" : resubmit_hint);
}

static int extend_read(struct jobs *jobs, const struct requester *requester, struct live_job *job,
		       const struct extension *x, const struct job_record *r, char *text, size_t size, struct error *e)
{
	struct plan_request request;
	struct plan plan;
	if (live_job_complete_rounds(job) == 0)
		return error_set(e, ENOENT, "its films have been deleted: %s", resubmit_hint);
	uint64_t blocker = job->state_bytes ? storage_find_states_blocker(jobs, job, job->state_bytes) : 0;
	if (blocker)
		return error_set(
			e, EAGAIN,
			"memory has no room for its chain states beside those of j%llu: extend it when that has ended",
			(unsigned long long)blocker);
	struct extension_basis basis =
		extension_from_job(job, isnan(job->times.last_round_end) ? 0 : job->times.last_round_end, r);
	int rc = make_plan(jobs, requester, job, x, &basis, &request, &plan, e);
	if (rc)
		return rc;
	set_bounds(job, &request, &plan);
	log_extension(requester, job, text, size);
	return resume_job(jobs, requester, job, r, e);
}

struct extension_request {
	struct extension_request *next;
	struct requester requester;
	struct extension extension;
};

static void answer_request(struct jobs *jobs, uint64_t peer, int rc, const struct error *e, const char *text)
{
	jobs->peers.answer_extension(jobs->peers.user, peer, rc ? e->text : NULL, text);
}

/* A task of the pool, because films may have hundreds of megabytes; one job at a time. */
struct read_task {
	uv_work_t work;
	struct jobs *jobs;
	struct requester requester; /* the peer may be gone */
	struct extension extension;
	struct job_record record; /* record of the job's end */
	struct live_job *job;
	int rc;
	struct error error;
};

static void read_ended_job(uv_work_t *work)
{
	struct read_task *w = work->data;
	w->rc = replay_films(w->jobs->spool, w->job, NULL, &w->error);
	if (!w->rc) /* acknowledgements from before its end may still wait for a flush of the old file */
		w->rc = journal_renew(w->job->journal, &w->error);
}

static void on_ended_job_read(uv_work_t *work, int status)
{
	struct read_task *w = work->data;
	struct jobs *jobs = w->jobs;
	bool is_connected = !jobs->is_stopping && jobs->peers.peer_name(jobs->peers.user, w->requester.peer);
	char text[256] = "";
	assert(status == 0);
	(void)status;
	jobs->extended_job = NULL;
	jobs->extending_peer = 0;
	if (w->rc)
		live_job_log(w->job, LOG_SPOOL_FAULT, "text=%s", log_quote(w->error.text).text);
	int rc = w->rc ? cannot_continue_error(w->rc, &w->error) : is_connected ? 0 : -ECANCELED;
	if (!rc)
		rc = extend_read(jobs, &w->requester, w->job, &w->extension, &w->record, text, sizeof text, &w->error);
	if (rc)
		restore_drop_job(jobs, w->job);
	if (is_connected)
		answer_request(jobs, w->requester.peer, rc, &w->error, text);
	mem_free(w);
	if (!jobs->is_stopping)
		extend_handle_waiting(jobs);
}

/* Checks the request as far as that is possible without the films. Assumes that no round is complete, so that nothing
 * is refused which the films would allow. */
static int check_beforehand(const struct jobs *jobs, const struct requester *requester, const struct live_job *job,
			    const struct extension *x, const struct job_record *r, struct error *e)
{
	struct plan_request request;
	struct plan plan;
	struct extension_basis basis = {
		.error = last_error(&r->looks), .has_ended = true, .was_extension_cancelled = r->cut};
	return make_plan(jobs, requester, job, x, &basis, &request, &plan, e);
}

static int start_reading(struct jobs *jobs, const struct extension_request *q, const struct job_record *r,
			 struct error *e)
{
	struct ledger_job j;
	int rc = read_row(jobs, r->id, &j, e);
	if (rc)
		return rc;
	struct read_task *w = mem_alloc(1, sizeof *w);
	rc = w ? restore_live_job(jobs, &j, &w->job, e) : error_set(e, ENOMEM, "no memory for a job");
	if (rc) {
		mem_free(w);
		return cannot_continue_error(rc, e);
	}
	rc = check_beforehand(jobs, &q->requester, w->job, &q->extension, r, e);
	if (rc) {
		restore_drop_job(jobs, w->job);
		mem_free(w);
		return rc;
	}
	w->jobs = jobs;
	w->requester = q->requester;
	w->extension = q->extension;
	w->record = *r;
	jobs->extended_job = w->job;
	jobs->extending_peer = q->requester.peer;
	jobs_queue_work(jobs, &w->work, w, read_ended_job, on_ended_job_read);
	return 0;
}

static int extend_ended(struct jobs *jobs, const struct extension_request *q, const struct job_record *r,
			struct error *e)
{
	if (strcmp(r->state, job_state_name(JOB_DONE)) != 0)
		return error_set(e, EINVAL, "it has %s, and nothing of it was kept: %s",
				 strcmp(r->state, "failed") == 0 ? "failed" : "been cancelled", resubmit_hint);
	if (strcmp(r->reason, job_end_name(END_BLACK)) == 0)
		return error_set(e, EINVAL, "it is black: no sample carried light");
	return start_reading(jobs, q, r, e);
}

/* Whether the request must wait: the job's films are in use, or those of another job are being read. */
static bool must_wait(const struct jobs *jobs, uint64_t id)
{
	const struct live_job *job = jobs_find_live(jobs, id);
	return job ? job->is_busy || job->has_ended : jobs->extended_job != NULL;
}

static void handle_request(struct jobs *jobs, const struct extension_request *q)
{
	struct live_job *job = jobs_find_live(jobs, q->extension.job);
	struct job_view v;
	struct error e = {""};
	char text[256] = "";
	int rc;
	if (job)
		rc = extend_live(jobs, &q->requester, job, &q->extension, text, sizeof text, &e);
	else if (!jobs_get_view(jobs, q->extension.job, &v))
		rc = error_set(&e, ENOENT, "no such job");
	else
		rc = extend_ended(jobs, q, &v.record, &e);
	if (rc || job) /* a finished job is answered when it has been read */
		answer_request(jobs, q->requester.peer, rc, &e, text);
}

/* Whether the peer has a request that is not answered yet. */
static bool has_request(const struct jobs *jobs, uint64_t peer)
{
	const struct extension_request *q = jobs->extension_requests;
	while (q && q->requester.peer != peer)
		q = q->next;
	return q || jobs->extending_peer == peer;
}

void extend_job(struct jobs *jobs, const struct requester *requester, const struct extension *x)
{
	struct extension_request *q = NULL, **at = &jobs->extension_requests;
	struct error e;
	int rc = has_request(jobs, requester->peer)
			 ? error_set(&e, EBUSY, "one extension at a time: the previous one is not answered yet")
			 : extend_check(x, &e);
	if (!rc && !(q = mem_alloc(1, sizeof *q)))
		rc = error_set(&e, ENOMEM, "no memory for an extension");
	if (rc) {
		answer_request(jobs, requester->peer, rc, &e, "");
		return;
	}
	*q = (struct extension_request){.requester = *requester, .extension = *x};
	while (*at)
		at = &(*at)->next;
	*at = q;
	extend_handle_waiting(jobs);
}

void extend_handle_waiting(struct jobs *jobs)
{
	for (struct extension_request **at = &jobs->extension_requests, *q; (q = *at);) {
		if (must_wait(jobs, q->extension.job)) {
			at = &q->next;
			continue;
		}
		*at = q->next;
		handle_request(jobs, q);
		mem_free(q);
		at = &jobs->extension_requests; /* the list may have changed */
	}
}

void extend_forget_peer(struct jobs *jobs, uint64_t peer)
{
	for (struct extension_request **at = &jobs->extension_requests, *q; (q = *at);) {
		if (q->requester.peer != peer) {
			at = &q->next;
			continue;
		}
		*at = q->next;
		mem_free(q);
	}
}
