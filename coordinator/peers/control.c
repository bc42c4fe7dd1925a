/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/control.h"

#include "common/base/text.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/jobs/extend.h"
#include "coordinator/jobs/finish.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/restore.h"
#include "coordinator/jobs/step.h"
#include "coordinator/peers/client_answers.h"

/* The name in the certificate. Without certificates clients could give any name, so none is used. */
static const char *name_of(const struct session *p)
{
	return *p->who.name ? p->who.name : "a client";
}

static int ask_core(struct session *p, struct event *ev, struct error *e)
{
	ev->tag = p->id;
	return jobs_ask(p->jobs, ev, &(struct incoming){0}, e);
}

/* Explains an order that the core has carried out but that could not be stored. The core is asked first, because only
 * it knows whether the order can be carried out. done: "held" or the like. */
static int not_for_long(int rc, const char *done, struct error *e)
{
	return error_prefix(e, rc, "%s, but only until the coordinator restarts", done);
}

static int hold(struct session *p, uint64_t id, const char *who, struct error *e)
{
	struct jobs *jobs = p->jobs;
	char text[256];
	struct event ev = {
		.kind = EVENT_HOLD, .job = id, .hold = HOLD_ORDERED, .text = *who ? restore_held_by(who, text) : ""};
	int rc = ask_core(p, &ev, e);
	if (rc)
		return rc;
	rc = ledger_hold(jobs->ledger, id, who, e);
	if (rc)
		return not_for_long(rc, *who ? "held" : "released", e);
	struct live_job *job = jobs_find(jobs, id);
	if (job)
		live_job_log(job, LOG_JOB_STATE, "state=%s by=%s", *who ? "held" : "released",
			     log_quote(name_of(p)).text);
	return 0;
}

static int set_priority(struct session *p, uint64_t id, int priority, struct error *e)
{
	struct jobs *jobs = p->jobs;
	struct event ev = {.kind = EVENT_PRIORITY, .job = id, .priority = priority};
	int rc = ask_core(p, &ev, e);
	if (rc)
		return rc;
	rc = ledger_priority(jobs->ledger, id, priority, e);
	if (rc)
		return not_for_long(rc, "its priority is changed", e);
	struct live_job *job = jobs_find(jobs, id);
	if (job)
		live_job_log(job, LOG_JOB_NOTE, "priority=%d by=%s", priority, log_quote(name_of(p)).text);
	return 0;
}

/* Returns an error if the client has no such job or, unless over_too is set, the job is over. The core may have
 * forgotten a job that is over. */
static int check_job_exists(const struct session *p, uint64_t job, bool over_too, struct error *e)
{
	struct job_view v;
	if (!client_finds_job(p, job, &v))
		return error_set(e, ENOENT, "no such job");
	return over_too || jobs_find(p->jobs, job) ? 0 : error_set(e, EINVAL, "the job is over");
}

void control_cancel(struct session *p, uint64_t job)
{
	struct error e;
	char text[96] = "";
	struct job_view v;
	struct event ev = {.kind = EVENT_CANCEL, .job = job};
	int rc = check_job_exists(p, job, false, &e);
	if (!rc)
		rc = ask_core(p, &ev, &e);
	if (!rc && (rc = finish_cancelled(p->jobs, job, &e)))
		rc = not_for_long(rc, "cancelled", &e);
	if (jobs_view(p->jobs, job, &v) && v.record.cut)
		text_print(text, sizeof text, "the extension of j%llu is cancelled; its finished image stays",
			   (unsigned long long)job);
	client_send_done(p, rc ? e.text : NULL, text);
}

void control_job(struct session *p, const Farm__Control *c)
{
	bool extends = c->verb == FARM__VERB__VERB_EXTEND;
	struct error e;
	struct requester by = {.peer = p->id, .unbounded = p->who.role == TLS_OPERATOR};
	text_copy(by.owner, sizeof by.owner, p->who.name);
	int rc = check_job_exists(p, c->job, extends, &e);
	if (!rc) {
		switch (c->verb) {
		case FARM__VERB__VERB_HOLD:
			rc = hold(p, c->job, name_of(p), &e);
			break;
		case FARM__VERB__VERB_RELEASE:
			rc = hold(p, c->job, "", &e);
			break;
		case FARM__VERB__VERB_PRIORITY:
			rc = set_priority(p, c->job, c->priority, &e);
			break;
		case FARM__VERB__VERB_EXTEND:
			extend_job(p->jobs, &by,
				   &(struct extension){.job = c->job,
						       .spp = c->more_spp,
						       .mutations = c->more_mutations,
						       .seconds = c->more_seconds,
						       .target_error = c->target_error});
			return; /* extend_job answers, now or later */
		default:	/* an unknown number in the message */
			rc = error_set(&e, EINVAL, "unknown request for a job");
		}
	}
	client_send_done(p, rc ? e.text : NULL, "");
}
