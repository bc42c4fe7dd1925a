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
static const char *client_name(const struct session *p)
{
	return *p->tls_peer.name ? p->tls_peer.name : "a client";
}

static int ask_core(struct session *p, struct event *ev, struct error *e)
{
	ev->tag = p->id;
	return jobs_try_step(p->jobs, ev, &(struct incoming){0}, e);
}

/* Explains an order that the core has carried out but that could not be stored. The core is asked first, because only
 * it knows whether the order can be carried out. done: "held" or the like. */
static int not_stored_error(int rc, const char *done, struct error *e)
{
	return error_prefix(e, rc, "%s, but only until the coordinator restarts", done);
}

static int set_hold(struct session *p, uint64_t id, const char *holder, struct error *e)
{
	struct jobs *jobs = p->jobs;
	char text[256];
	struct event ev = {.kind = EVENT_HOLD,
			   .job = id,
			   .hold = HOLD_USER,
			   .text = *holder ? restore_hold_text(holder, text) : ""};
	int rc = ask_core(p, &ev, e);
	if (rc)
		return rc;
	rc = ledger_set_holder(jobs->ledger, id, holder, e);
	if (rc)
		return not_stored_error(rc, *holder ? "held" : "released", e);
	struct live_job *job = jobs_find_live(jobs, id);
	if (job)
		live_job_log(job, LOG_JOB_STATE, "state=%s by=%s", *holder ? "held" : "released",
			     log_quote(client_name(p)).text);
	return 0;
}

static int set_priority(struct session *p, uint64_t id, int priority, struct error *e)
{
	struct jobs *jobs = p->jobs;
	struct event ev = {.kind = EVENT_SET_PRIORITY, .job = id, .priority = priority};
	int rc = ask_core(p, &ev, e);
	if (rc)
		return rc;
	rc = ledger_set_priority(jobs->ledger, id, priority, e);
	if (rc)
		return not_stored_error(rc, "its priority is changed", e);
	struct live_job *job = jobs_find_live(jobs, id);
	if (job)
		live_job_log(job, LOG_JOB_NOTE, "priority=%d by=%s", priority, log_quote(client_name(p)).text);
	return 0;
}

/* Returns an error if the client has no such job or, unless allow_ended is set, the job is over. The core may have
 * forgotten a job that is over. */
static int check_job_exists(const struct session *p, uint64_t job, bool allow_ended, struct error *e)
{
	struct job_view v;
	if (!client_find_job(p, job, &v))
		return error_set(e, ENOENT, "no such job");
	return allow_ended || jobs_find_live(p->jobs, job) ? 0 : error_set(e, EINVAL, "the job is over");
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
	if (!rc && (rc = finish_check_cancelled(p->jobs, job, &e)))
		rc = not_stored_error(rc, "cancelled", &e);
	if (jobs_get_view(p->jobs, job, &v) && v.record.cut)
		text_print(text, sizeof text, "the extension of j%llu is cancelled; its finished image stays",
			   (unsigned long long)job);
	client_send_done(p, rc ? e.text : NULL, text);
}

void control_apply(struct session *p, const Farm__Control *c)
{
	bool extends = c->verb == FARM__VERB__VERB_EXTEND;
	struct error e;
	struct requester requester = {.peer = p->id, .is_exempt_from_quota = p->tls_peer.role == TLS_OPERATOR};
	text_copy(requester.owner, sizeof requester.owner, p->tls_peer.name);
	int rc = check_job_exists(p, c->job, extends, &e);
	if (!rc) {
		switch (c->verb) {
		case FARM__VERB__VERB_HOLD:
			rc = set_hold(p, c->job, client_name(p), &e);
			break;
		case FARM__VERB__VERB_RELEASE:
			rc = set_hold(p, c->job, "", &e);
			break;
		case FARM__VERB__VERB_PRIORITY:
			rc = set_priority(p, c->job, c->priority, &e);
			break;
		case FARM__VERB__VERB_EXTEND:
			extend_job(p->jobs, &requester,
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
