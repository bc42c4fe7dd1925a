#include "coordinator/shell/extend.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/shell/dispatch.h"
#include "coordinator/shell/durable.h"
#include "coordinator/shell/keep.h"
#include "coordinator/shell/restore.h"
#include "coordinator/shell/session.h"

#include <math.h>
#include <string.h>

static const char *const again = "submit it again (hslt-submit)";

/* ---- the new plan ---- */

static struct extension_from where(const struct order *o, double seconds, bool ended)
{
	const struct forecast_history *h = &o->record.looks;
	const struct forecast_look *last = h->count ? &h->looks[h->count - 1] : NULL;
	return (struct extension_from){.rounds = order_rounds(o), .seconds = seconds, .error = last ? sqrt(last->rel_mse_upper) : NAN,
				       .ended = ended};
}

static int plan_of(const struct session *p, const struct order *o, const struct extension *x, const struct extension_from *from,
		   struct plan_request *asked, struct plan *plan, struct error *e)
{
	int rc = plan_request_from_wire(order_submit(o)->plan, asked, e);
	if (!rc)
		rc = extend_plan(&o->plan, x, from, asked, plan, e);
	return rc ? rc : session_within_quota(p, o->id, plan, order_submit(o), e);
}

static void set_bounds(struct order *o, const struct plan_request *asked, const struct plan *plan)
{
	Farm__PlanRequest *r = o->submit.message->submit->plan;
	r->spp = asked->spp;
	r->mutations = asked->mutations;
	r->seconds = asked->seconds;
	r->target_error = asked->target_error;
	o->plan = *plan;
	o->record.target_error = plan->target_error;
	if (o->canvas)
		canvas_set_rounds(o->canvas, plan->rounds);
}

static int store(struct server *s, const struct order *o, struct error *e)
{
	struct ledger_job j = {.id = o->id};
	unsigned char *submission, *plan;
	int rc = durable_pack(o, &j, &submission, &plan, e);
	if (!rc)
		rc = ledger_extend(s->ledger, &j, e);
	mem_free(submission);
	mem_free(plan);
	return rc;
}

/* The bounds that the job has now, for its log and for the client. */
static void describe(const struct order *o, char *text, size_t size)
{
	struct text t = {text, size};
	const char *comma = "";
	text_put(&t, "after %llu rounds it goes on until", (unsigned long long)order_rounds(o));
	if (o->plan.rounds != UINT64_MAX) {
		text_put(&t, " %llu are done", (unsigned long long)o->plan.rounds);
		comma = " or";
	}
	if (o->plan.seconds > 0) {
		text_put(&t, "%s %.3g s are over", comma, o->plan.seconds);
		comma = " or";
	}
	if (o->plan.target_error > 0)
		text_put(&t, "%s its error is %.3g %%", comma, 100 * o->plan.target_error);
}

static void note(const struct session *p, struct order *o, char *text, size_t size)
{
	describe(o, text, size);
	order_log(o, LOG_JOB_STATE, "state=extended by=%s text=%s", *p->who.name ? p->who.name : "-", log_quote(text).text);
}

/* ---- a job that runs ---- */

static int extend_live(struct session *p, struct order *o, const struct extension *x, char *text, size_t size, struct error *e)
{
	struct server *s = p->server;
	struct plan_request asked, old_asked;
	struct plan plan, old = o->plan;
	double seconds = farm_elapsed(s->farm, o->id, server_now(s));
	struct extension_from from = where(o, isnan(seconds) ? 0 : seconds, false);
	int rc = plan_request_from_wire(order_submit(o)->plan, &old_asked, e);
	if (!rc)
		rc = plan_of(p, o, x, &from, &asked, &plan, e);
	if (rc)
		return rc;
	set_bounds(o, &asked, &plan);
	rc = store(s, o, e);
	if (rc) {
		set_bounds(o, &old_asked, &old);
		return rc;
	}
	note(p, o, text, size);
	struct event ev = {.kind = EVENT_EXTEND, .tag = p->id, .job = o->id, .plan = &o->plan};
	server_step(s, &ev);
	return 0;
}

/* ---- a job that is done ---- */

static void forget_end(struct server *s, uint64_t job)
{
	for (size_t i = 0; i < s->ended_count; i++)
		if (s->ended[i].id == job) {
			memmove(&s->ended[i], &s->ended[i + 1], (--s->ended_count - i) * sizeof *s->ended);
			return;
		}
}

/* Its row, and what is kept of it beside. */
static int read_job(const struct server *s, uint64_t job, struct ledger_job *j, struct error *e)
{
	int rc = ledger_get(s->ledger, job, j, e);
	if (rc == 0)
		rc = -ENOENT;
	if (rc > 0)
		rc = keep_read(s, job, j, e);
	if (rc == -ENOENT)
		return error_set(e, ENOENT, "its films have been cleared: %s", again);
	return rc ? error_prefix(e, rc, "what was kept of it") : 0;
}

/* r: as it was remembered. */
static int begin_again(struct session *p, struct order *o, const struct job_record *r, struct error *e)
{
	struct server *s = p->server;
	struct error fault;
	int rc = store(s, o, e);
	if (rc)
		return rc;
	o->record.extended++;
	o->record.has_result = r->has_result;
	o->next = s->orders;
	s->orders = o;
	forget_end(s, o->id);
	rc = restore_tell(s, o, "", p->id, e);
	if (!rc && !*p->rejected)
		return 0;
	if (!rc)
		rc = error_set(e, EAGAIN, "%s", p->rejected);
	s->orders = o->next;
	dispatch_remember(s, r);
	if (ledger_end(s->ledger, o->id, job_state_name(JOB_DONE), &fault)) /* then it goes on when the coordinator starts again */
		log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)o->id, log_quote(fault.text).text);
	return rc;
}

static int extend_ended(struct session *p, const struct extension *x, const struct job_record *r, char *text, size_t size,
			struct error *e)
{
	struct server *s = p->server;
	struct ledger_job j;
	struct order *o = NULL;
	struct plan_request asked;
	struct plan plan;
	if (strcmp(r->state, job_state_name(JOB_DONE)) != 0)
		return error_set(e, EINVAL, "it has %s, and nothing of it was kept: %s", strcmp(r->state, "failed") == 0 ? "failed" : "been cancelled",
				 again);
	if (strcmp(r->reason, job_end_name(END_BLACK)) == 0)
		return error_set(e, EINVAL, "it is black: chains have nowhere to begin");
	int rc = read_job(s, r->id, &j, e);
	if (rc)
		return rc;
	union {
		const unsigned char *from;
		unsigned char *to;
	} submission = {j.submission}, frame = {j.plan}; /* ours */
	rc = restore_order(s, &j, &o, e);
	mem_free(submission.to);
	mem_free(frame.to);
	if (rc)
		return error_prefix(e, rc, "it cannot go on, %s", again);
	if (order_rounds(o) == 0)
		rc = error_set(e, ENOENT, "its films have been cleared: %s", again);
	struct extension_from from = where(o, isnan(o->times.completed) ? 0 : o->times.completed, true);
	if (!rc)
		rc = plan_of(p, o, x, &from, &asked, &plan, e);
	if (!rc) {
		set_bounds(o, &asked, &plan);
		note(p, o, text, size);
		rc = begin_again(p, o, r, e);
	}
	if (rc) {
		order_release_blobs(order_submit(o), s->blobs);
		order_free(o);
	}
	return rc;
}

/* ---- both ---- */

static bool must_wait(const struct order *o)
{
	return o && (o->busy || o->ended);
}

void extend_job(struct session *p, const struct extension *x)
{
	struct server *s = p->server;
	struct order *o = server_order(s, x->job);
	struct job_view v;
	struct error e = {""};
	char text[256] = "";
	if (must_wait(o)) {
		p->wants = *x;
		p->server->extend_waits = true;
		return;
	}
	p->rejected[0] = 0;
	int rc = 0;
	if (o)
		rc = extend_live(p, o, x, text, sizeof text, &e);
	else if (!server_view(s, x->job, &v))
		rc = error_set(&e, ENOENT, "no such job");
	else
		rc = extend_ended(p, x, &v.record, text, sizeof text, &e);
	if (rc)
		text_copy(p->rejected, sizeof p->rejected, e.text);
	session_send_done(p, text);
}

void extend_waiting(struct server *s)
{
	if (!s->extend_waits)
		return;
	s->extend_waits = false;
	for (struct session *p = s->sessions; p; p = p->next) {
		struct extension x = p->wants;
		if (!x.job)
			continue;
		p->wants.job = 0;
		extend_job(p, &x); /* which may let it wait on */
	}
}
