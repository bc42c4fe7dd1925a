#include "coordinator/shell/durable.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/version.h"
#include "common/wire/frame.h"
#include "coordinator/shell/keep.h"
#include "coordinator/shell/session.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double try_again_seconds = 2;

struct durable_ack {
	struct durable_ack *next;
	uint64_t peer;
	struct lease_key key;
	enum ack ack;
	struct journal *journal; /* held */
};

/* One flush for all that has come so far. */
struct flush {
	uv_work_t work;
	struct server *server;
	struct durable_ack *acks;
};

/* ---- jobs ---- */

static int pack_plan(const struct order *o, unsigned char **frame, size_t *size, struct error *e)
{
	Farm__JobInfo info;
	Farm__Plan plan;
	Farm__Envelope m;
	farm__job_info__init(&info);
	farm__envelope__init(&m);
	plan_to_wire(&o->plan, &plan);
	info.job = o->id;
	info.plan = &plan;
	m.body_case = FARM__ENVELOPE__BODY_JOB_INFO;
	m.job_info = &info;
	return envelope_pack(&m, NULL, 0, frame, size, e);
}

int durable_pack(const struct order *o, struct ledger_job *j, unsigned char **submission, unsigned char **plan, struct error *e)
{
	*submission = *plan = NULL;
	int rc = envelope_pack(o->submit.message, NULL, 0, submission, &j->submission_size, e);
	if (!rc)
		rc = pack_plan(o, plan, &j->plan_size, e);
	j->submission = *submission;
	j->plan = *plan;
	return rc;
}

int durable_begin(struct server *s, struct order *o, struct error *e)
{
	char folder[SPOOL_PATH_MAX];
	unsigned char *submission, *plan;
	struct ledger_job j = {.id = o->id, .owner = o->record.owner, .name = o->record.name, .version = HSLT_VERSION,
			       .priority = o->record.priority, .mixed = order_submit(o)->mixed, .submitted = o->record.submitted};
	spool_job_path(s->spool, o->id, NULL, folder);
	int rc = durable_pack(o, &j, &submission, &plan, e);
	if (!rc)
		rc = journal_create(&o->journal, folder, o->id, 0, e);
	if (!rc)
		rc = ledger_add(s->ledger, &j, e);
	mem_free(submission);
	mem_free(plan);
	return rc;
}

void durable_end(struct server *s, struct order *o)
{
	struct error e;
	bool kept = keep_order(s, o);
	int rc = spool_write_record(s->spool, &o->record, &e);
	if (rc == -ENOSPC)
		kept = false;
	journal_release(o->journal); /* with its last holder it gives up its room, too */
	o->journal = NULL;
	if (!kept)
		keep_drop(s, o->id);
	if (rc == -ENOSPC)
		rc = spool_write_record(s->spool, &o->record, &e);
	if (rc)
		order_log(o, LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	/* The record says it already: without this row the next start reads it there. */
	if (ledger_end(s->ledger, o->id, o->record.state, &e))
		log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)o->id, log_quote(e.text).text);
}

/* ---- batches ---- */

static void hold(struct server *s, struct order *o, const char *text)
{
	struct event ev = {.kind = EVENT_HOLD, .job = o->id, .text = text};
	if (!*text != !o->held) {
		order_log(o, LOG_JOB_STATE, "state=%s text=%s", *text ? "held" : "released", log_quote(text).text);
		o->held = *text != 0;
	}
	o->try_again = server_now(s) + try_again_seconds;
	server_step(s, &ev);
}

int durable_reserve(struct server *s, struct order *o, struct error *e)
{
	union {
		const Farm__LeaseResult *from;
		Farm__LeaseResult *to;
	} result = {s->result}; /* generated structures have no const */
	Farm__Envelope m;
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_LEASE_RESULT;
	m.lease_result = result.to;
	if (!o->journal)
		return error_set(e, EIO, "the job's journal cannot be written");
	int rc = envelope_pack(&m, NULL, 0, &s->frame, &s->frame_size, e);
	if (rc)
		return rc;
	frame_prefix_write(s->frame, (uint32_t)(s->frame_size - FRAME_PREFIX), (uint32_t)s->payload_size);
	rc = journal_reserve(o->journal, s->frame_size + s->payload_size, e);
	if (rc == -ENOSPC && keep_drop_all(s))
		rc = journal_reserve(o->journal, s->frame_size + s->payload_size, e);
	if (!rc)
		return 0;
	char text[256];
	o->held_bytes = s->frame_size + s->payload_size;
	snprintf(text, sizeof text, "its results cannot be stored: %.200s", e->text);
	hold(s, o, text);
	return rc;
}

/* Whose it is, once, before its first batch. */
static int write_pinned(struct server *s, struct order *o, double elapsed, struct error *e)
{
	struct job_status status;
	if (o->pinned || !farm_job(s->farm, o->id, server_now(s), &status) || !*status.fingerprint)
		return 0;
	o->pinned = true;
	return journal_append(o->journal, JOURNAL_PINNED, elapsed, status.fingerprint, strlen(status.fingerprint), NULL, 0, e);
}

int durable_merged(struct server *s, struct order *o, struct error *e)
{
	double elapsed = farm_elapsed(s->farm, o->id, server_now(s));
	assert(s->frame && o->journal);
	int rc = write_pinned(s, o, elapsed, e);
	if (!rc)
		rc = journal_append(o->journal, JOURNAL_BATCH, elapsed, s->frame, s->frame_size, s->payload, s->payload_size, e);
	if (rc) { /* what is merged but not written must not be acknowledged */
		journal_release(o->journal);
		o->journal = NULL;
	}
	return rc;
}

/* ---- group commit ---- */

static void flush_next(struct server *s);

static void run(uv_work_t *work)
{
	struct flush *w = work->data;
	for (struct durable_ack *a = w->acks; a; a = a->next) {
		struct error e;
		if (journal_sync(a->journal, &e)) {
			a->peer = 0; /* no answer; `done` says why */
			log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
		}
	}
}

static void answer(struct server *s, struct durable_ack *a)
{
	struct session *p = s->stopping ? NULL : session_find(s, a->peer);
	if (a->peer == 0 && !s->stopping) {
		struct event ev = {.kind = EVENT_JOB_BROKEN, .job = a->key.job, .text = "its journal cannot be written to the disk"};
		server_step(s, &ev);
	}
	if (a->peer && a->ack == ACK_MERGED)
		log_event(LOG_BATCH_STORED, "job=j%llu peer=%llu kind=%d group=%u part=%u epoch=%llu", (unsigned long long)a->key.job,
			  (unsigned long long)a->peer, (int)a->key.kind, a->key.group, a->key.part, (unsigned long long)a->key.epoch);
	if (p)
		session_send_ack(p, &a->key, a->ack, "");
	journal_release(a->journal);
	mem_free(a);
}

static void done(uv_work_t *work, int status)
{
	struct flush *w = work->data;
	struct server *s = w->server;
	assert(status == 0);
	(void)status;
	s->flushing = false;
	while (w->acks) {
		struct durable_ack *a = w->acks;
		w->acks = a->next;
		answer(s, a);
	}
	mem_free(w);
	flush_next(s);
}

static void flush_next(struct server *s)
{
	if (s->flushing || !s->acks)
		return;
	struct flush *w = mem_alloc(1, sizeof *w);
	if (!w) /* as for an event: without 200 bytes nothing goes on */
		abort();
	w->server = s;
	w->acks = s->acks;
	w->work.data = w;
	s->acks = NULL;
	s->acks_last = &s->acks;
	s->flushing = true;
	int rc = uv_queue_work(&s->loop, &w->work, run, done);
	assert(rc == 0);
	(void)rc;
}

void durable_ack(struct server *s, const struct order *o, uint64_t peer, const struct lease_key *k, enum ack ack)
{
	struct durable_ack *a = mem_alloc(1, sizeof *a);
	if (!a || !o->journal) { /* not answered: the worker offers it again, and it is a repeat */
		mem_free(a);
		return;
	}
	*a = (struct durable_ack){.peer = peer, .key = *k, .ack = ack, .journal = o->journal};
	journal_hold(a->journal);
	*s->acks_last = a;
	s->acks_last = &a->next;
	flush_next(s);
}

/* ---- the rest ---- */

void durable_look(struct server *s, uint64_t job)
{
	struct order *o = server_order(s, job);
	struct job_status status;
	struct error e;
	if (!o || !o->journal || !farm_job(s->farm, job, server_now(s), &status) || status.looks->count == 0)
		return;
	const struct forecast_look *l = &status.looks->looks[status.looks->count - 1];
	if (l->work <= o->look_written)
		return;
	o->look_written = l->work;
	/* Only forecasts are made of it: the look itself is taken again. */
	if (journal_append(o->journal, JOURNAL_LOOK, farm_elapsed(s->farm, job, server_now(s)), l, sizeof *l, NULL, 0, &e))
		log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)job, log_quote(e.text).text);
}

/* Not before each answer: it is for the record alone. */
static void write_counts(struct server *s, struct order *o)
{
	struct job_counts now;
	struct error e;
	if (o->ended || !o->journal || !farm_counts(s->farm, o->id, &now) || memcmp(&now, &o->counts, sizeof now) == 0)
		return;
	if (journal_append(o->journal, JOURNAL_COUNTS, o->times.elapsed, &now, sizeof now, NULL, 0, &e) == 0)
		o->counts = now;
}

void durable_tick(struct server *s)
{
	for (struct order *o = s->orders; o; o = o->next)
		write_counts(s, o);
	for (struct order *o = s->orders, *next; o; o = next) {
		struct error e;
		next = o->next;
		if (!o->held || o->ended || server_now(s) < o->try_again)
			continue;
		o->try_again = server_now(s) + try_again_seconds;
		if (o->journal && journal_reserve(o->journal, 2 * o->held_bytes, &e) == 0) {
			hold(s, o, "");
			return; /* the list may have changed; the others next time */
		}
	}
}

void durable_close(struct server *s)
{
	assert(!s->flushing && !s->acks);
	ledger_close(s->ledger);
}
