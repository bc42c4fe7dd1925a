/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/control.h"

#include "common/base/text.h"
#include "coordinator/jobs/extend.h"
#include "coordinator/jobs/finish.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/restore.h"
#include "coordinator/jobs/step.h"
#include "coordinator/peers/client_answers.h"

/* Without certificates anybody can use any name. */
static const char *name_of(const struct session *p)
{
	return *p->who.name ? p->who.name : "a client";
}

static int ask_core(struct session *p, struct event *ev)
{
	ev->tag = p->id;
	jobs_step(p->jobs, ev);
	return *p->rejected ? -1 : 0;
}

/* The core knows whether it can be done, so it is asked first. done: "held" or the like. */
static void not_for_long(struct session *p, const char *done, const struct error *e)
{
	text_print(p->rejected, sizeof p->rejected, "%s, but only until the coordinator restarts: %s", done, e->text);
}

static void hold(struct session *p, uint64_t id, const char *who)
{
	struct jobs *jobs = p->jobs;
	struct error e;
	char text[256];
	struct event ev = {
		.kind = EVENT_HOLD, .job = id, .hold = HOLD_ORDERED, .text = *who ? restore_held_by(who, text) : ""};
	if (ask_core(p, &ev))
		return;
	if (ledger_hold(jobs->ledger, id, who, &e)) {
		not_for_long(p, *who ? "held" : "released", &e);
		return;
	}
	struct live_job *job = jobs_find(jobs, id);
	if (job)
		live_job_log(job, LOG_JOB_STATE, "state=%s by=%s", *who ? "held" : "released",
			     log_quote(name_of(p)).text);
}

static void set_priority(struct session *p, uint64_t id, int priority)
{
	struct jobs *jobs = p->jobs;
	struct error e;
	struct event ev = {.kind = EVENT_PRIORITY, .job = id, .priority = priority};
	if (ask_core(p, &ev))
		return;
	if (ledger_priority(jobs->ledger, id, priority, &e)) {
		not_for_long(p, "its priority is changed", &e);
		return;
	}
	struct live_job *job = jobs_find(jobs, id);
	if (job)
		live_job_log(job, LOG_JOB_NOTE, "priority=%d by=%s", priority, log_quote(name_of(p)).text);
}

/* The core may have forgotten a job that is over. false: p->rejected is the reason. */
static bool finds(struct session *p, uint64_t job, bool over_too)
{
	struct job_view v;
	bool there = client_finds_job(p, job, &v);
	text_copy(p->rejected, sizeof p->rejected,
		  !there				? "no such job"
		  : over_too || jobs_find(p->jobs, job) ? ""
							: "the job is over");
	return !*p->rejected;
}

void control_cancel(struct session *p, uint64_t job)
{
	struct error e;
	char text[96] = "";
	struct job_view v;
	struct event ev = {.kind = EVENT_CANCEL, .job = job};
	if (finds(p, job, false) && !ask_core(p, &ev) && finish_cancelled(p->jobs, job, &e))
		not_for_long(p, "cancelled", &e);
	if (jobs_view(p->jobs, job, &v) && v.record.cut)
		text_print(text, sizeof text, "the extension of j%llu is cancelled; its finished image stays",
			   (unsigned long long)job);
	client_send_done(p, text);
}

void control_job(struct session *p, const Farm__Control *c)
{
	bool extends = c->verb == FARM__VERB__VERB_EXTEND;
	struct requester by = {.peer = p->id, .unbounded = p->who.role == TLS_OPERATOR};
	text_copy(by.owner, sizeof by.owner, p->who.name);
	if (finds(p, c->job, extends)) {
		switch (c->verb) {
		case FARM__VERB__VERB_HOLD:
			hold(p, c->job, name_of(p));
			break;
		case FARM__VERB__VERB_RELEASE:
			hold(p, c->job, "");
			break;
		case FARM__VERB__VERB_PRIORITY:
			set_priority(p, c->job, c->priority);
			break;
		case FARM__VERB__VERB_EXTEND:
			extend_job(p->jobs, &by,
				   &(struct extension){.job = c->job,
						       .spp = c->more_spp,
						       .mutations = c->more_mutations,
						       .seconds = c->more_seconds,
						       .target_error = c->target_error});
			return; /* answered now or later */
		default:	/* an untrusted number */
			text_copy(p->rejected, sizeof p->rejected, "unknown request for a job");
		}
	}
	client_send_done(p, "");
}
