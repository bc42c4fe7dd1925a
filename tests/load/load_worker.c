/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A fake worker of the load test: the worker's side of the conversation in proto/README.md, without rendering. It says
 * hello, asks for leases, fetches the job's files, waits as long as a lease would take, sends a prepared result and
 * waits for its acknowledgement. Workers of the dishonest kinds (load.h) hang up, send results that are no numbers,
 * hoard leases, or fall silent. Messages against the protocol are counted as faults of the run; a plan that differs
 * from the job's ends the run.
 */
#include "tests/load/load.h"

#include "common/base/mem.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { HOARD = 4096 };
enum { LEASES = 8, WISHES = 8, HEADER_LIMIT = 1 << 22, PAYLOAD_LIMIT = 1 << 28, SEND_LIMIT = 1 << 30 };
enum lease_state { FREE, WAITING, WORKING, SENDING, SENT };

struct held {
	enum lease_state state;
	struct lease_key key;
	double since; /* s; SENDING: when sending began; SENT: when all of it was handed over */
};

struct load_worker {
	struct load *load;
	struct conn *conn; /* NULL: not connected */
	uv_timer_t work, beat;
	unsigned index;
	int closing; /* timers of the closed connection that still have to close */
	enum load_kind kind;
	bool hangs;
	uint64_t jobs_ready; /* bit set: jobs whose files the worker has */
	uint64_t jobs_asked;
	struct held held[LEASES];
	double wish[WISHES]; /* for each lease it waits for, when it could have been granted; NAN: not yet */
	unsigned wishes;
	double beat_at; /* 0: the heartbeat was answered */
	bool first, asked;
};

static void work_on(struct load_worker *w);

static void send_message(struct load_worker *w, Farm__Envelope *m, Farm__Envelope__BodyCase body)
{
	m->body_case = body;
	if (w->conn)
		conn_send(w->conn, m, NULL, 0);
}

static void fail_worker(struct load_worker *w, const char *text)
{
	struct load *l = w->load;
	if (!l->faults++)
		snprintf(l->fault, sizeof l->fault, "worker %u: %s", w->index, text);
}

static void add_wish(struct load_worker *w, double at)
{
	if (w->wishes < WISHES)
		w->wish[w->wishes++] = at;
}

static void request_leases(struct load_worker *w, unsigned want)
{
	Farm__LeaseRequest r;
	Farm__Envelope m;
	farm__lease_request__init(&r);
	farm__envelope__init(&m);
	r.want = want;
	m.lease_request = &r;
	send_message(w, &m, FARM__ENVELOPE__BODY_LEASE_REQUEST);
}

static void give_back(struct load_worker *w, struct held *h)
{
	char nothing[] = "";
	Farm__LeaseKey key;
	Farm__LeaseFailed f;
	Farm__Envelope m;
	farm__lease_failed__init(&f);
	farm__envelope__init(&m);
	lease_key_to_wire(&h->key, &key);
	f.key = &key;
	f.text = nothing;
	m.lease_failed = &f;
	send_message(w, &m, FARM__ENVELOPE__BODY_LEASE_FAILED);
	h->state = FREE;
	w->load->given_back++;
}

/* ---- jobs and their files */

static struct load_job *job_of(const struct load *l, uint64_t id, unsigned *index)
{
	for (unsigned i = 0; i < l->job_count; i++)
		if (l->jobs[i].id == id) {
			*index = i;
			return &l->jobs[i];
		}
	return NULL;
}

static void ask_job(struct load_worker *w, uint64_t job)
{
	Farm__JobGet get;
	Farm__Envelope m;
	farm__job_get__init(&get);
	farm__envelope__init(&m);
	get.job = job;
	m.job_get = &get;
	send_message(w, &m, FARM__ENVELOPE__BODY_JOB_GET);
}

static void ask_file(struct load_worker *w, const Farm__File *f)
{
	Farm__BlobGet get;
	Farm__Envelope m;
	farm__blob_get__init(&get);
	farm__envelope__init(&m);
	get.hash = f->hash;
	m.blob_get = &get;
	send_message(w, &m, FARM__ENVELOPE__BODY_BLOB_GET);
}

/* Each scene is one small file. */
static void take_job(struct load_worker *w, const Farm__JobInfo *info)
{
	struct load *l = w->load;
	struct error e;
	unsigned i;
	struct load_job *j = job_of(l, info->job, &i);
	struct plan p;
	if (!j || info->n_files != 1 || plan_from_wire(info->plan, &p, &e)) {
		fail_worker(w, "a job that is not one of ours");
		return;
	}
	if (!j->known && (p.groups * p.parts != j->plan.groups * j->plan.parts || p.epoch != j->plan.epoch))
		load_die("the coordinator has made another plan");
	j->known = true;
	ask_file(w, info->files[0]);
	w->jobs_ready |= UINT64_C(1) << i;
	work_on(w);
}

/* ---- leases */

static struct held *find(struct load_worker *w, const struct lease_key *k)
{
	for (int i = 0; i < LEASES; i++) {
		struct held *h = &w->held[i];
		if (h->state != FREE && h->key.job == k->job && h->key.kind == k->kind && h->key.group == k->group &&
		    h->key.part == k->part && h->key.epoch == k->epoch)
			return h;
	}
	return NULL;
}

static struct held *in_state(struct load_worker *w, enum lease_state state)
{
	for (int i = 0; i < LEASES; i++)
		if (w->held[i].state == state)
			return &w->held[i];
	return NULL;
}

static void send_result(struct load_worker *w, struct held *h)
{
	struct load *l = w->load;
	size_t size;
	unsigned char *frame = load_content_frame(l->content, &h->key, &size);
	h->state = SENDING;
	h->since = load_now();
	add_wish(w, NAN);
	if (w->kind == LOAD_LIES) {
		memset(frame + size / 2, 0xff, 64); /* pixels that are not numbers */
		l->lies++;
	}
	if (l->measuring) {
		l->batches++;
		l->bytes += size;
	}
	conn_send_frame(w->conn, frame, size);
}

/* Returns true if the worker disconnects instead of sending a finished result. It does not do so while the answer to
 * another result is under way, which would not be counted. */
static bool ends_badly(struct load_worker *w)
{
	struct load *l = w->load;
	if ((w->kind != LOAD_DIES && w->kind != LOAD_HANGS) || in_state(w, SENDING) || in_state(w, SENT) ||
	    load_uniform(l) > 1. / 3)
		return false;
	if (w->kind == LOAD_DIES) {
		l->deaths++;
		conn_close(w->conn, "dies");
	} else {
		l->hangs++;
		w->hangs = true;
		uv_timer_stop(&w->beat);
	}
	return true;
}

static void on_worked(uv_timer_t *t)
{
	struct load_worker *w = t->data;
	struct held *h = in_state(w, WORKING);
	if (w->hangs || (h && w->conn && ends_badly(w)))
		return;
	if (h && w->conn)
		send_result(w, h);
	work_on(w);
}

static void work_on(struct load_worker *w)
{
	struct load *l = w->load;
	unsigned i = 0;
	struct held *h = l->leaving || w->hangs || in_state(w, WORKING) ? NULL : in_state(w, WAITING);
	if (!h || !job_of(l, h->key.job, &i) || !(w->jobs_ready >> i & 1))
		return;
	h->state = WORKING;
	/* Leases of the bootstrap are short; workers begin their first render lease at different times, which spreads
	 * the crowd over the interval. */
	double seconds = l->s.interval * (0.9 + 0.2 * load_uniform(l));
	if (h->key.kind == LEASE_BOOTSTRAP)
		seconds = fmin(1, seconds) * (0.5 + 0.5 * load_uniform(l));
	else if (w->first)
		seconds += l->s.interval * load_uniform(l);
	w->first = w->first && h->key.kind == LEASE_BOOTSTRAP;
	uv_timer_start(&w->work, on_worked, (uint64_t)(1000 * seconds) + 1, 0);
}

static void take_grant(struct load_worker *w, const Farm__LeaseGrant *m)
{
	struct load *l = w->load;
	struct error e;
	unsigned i;
	struct held *h = in_state(w, FREE);
	struct lease_key k;
	if (w->kind == LOAD_HOARDS) {
		l->hoarded++;
		return;
	}
	if (!h || lease_key_from_wire(m->key, &k, &e) || !job_of(l, k.job, &i)) {
		fail_worker(w, "a lease that cannot be");
		return;
	}
	if (find(w, &k)) { /* the lease was overdue, and no other worker is free */
		l->again++;
		return;
	}
	l->grants++;
	double now = load_now();
	if (w->wishes) {
		double at = w->wish[0], ms = isnan(at) ? 0 : 1000 * (now - at);
		memmove(w->wish, w->wish + 1, --w->wishes * sizeof *w->wish);
		if (l->measuring)
			load_times_add(w->asked ? &l->grant : &l->first_grant, ms);
		else if (!w->asked)
			load_times_add(&l->first_grant, ms);
		w->asked = true;
	}
	*h = (struct held){.state = WAITING, .key = k};
	if (!(w->jobs_asked >> i & 1)) {
		w->jobs_asked |= UINT64_C(1) << i;
		ask_job(w, k.job);
	}
	work_on(w);
}

/* Each epoch of a slot must come once, in order. */
static void count_merged(struct load *l, const struct lease_key *k)
{
	unsigned i;
	struct load_job *j = job_of(l, k->job, &i);
	if (k->kind == LEASE_BOOTSTRAP) {
		l->bootstrap_merged++;
		return;
	}
	l->merged++;
	uint64_t *epoch = &j->acknowledged[k->group * j->plan.parts + k->part];
	l->disordered += k->epoch != *epoch;
	*epoch = k->epoch + 1;
}

static void take_ack(struct load_worker *w, const Farm__LeaseAck *m)
{
	struct load *l = w->load;
	struct error e;
	struct lease_key k;
	struct held *h = lease_key_from_wire(m->key, &k, &e) ? NULL : find(w, &k);
	if (!h || h->state < SENDING) {
		fail_worker(w, "an answer to nothing");
		return;
	}
	l->lies_merged += w->kind == LOAD_LIES && m->verdict == FARM__VERDICT__VERDICT_MERGED;
	if (m->verdict == FARM__VERDICT__VERDICT_MERGED)
		count_merged(l, &k);
	else if (m->verdict == FARM__VERDICT__VERDICT_REPEATED)
		l->repeated++;
	else if (w->kind == LOAD_LIES)
		l->lies_refused++;
	else {
		l->refused++;
		fail_worker(w, m->text);
	}
	if (l->measuring)
		load_times_add(&l->ack, 1000 * (load_now() - h->since));
	h->state = FREE;
}

static void take_revoke(struct load_worker *w, const Farm__LeaseRevoke *m)
{
	struct error e;
	struct lease_key k;
	struct held *h = lease_key_from_wire(m->key, &k, &e) ? NULL : find(w, &k);
	if (!h || h->state > WORKING) /* its result is under way and will count as a repeat */
		return;
	if (h->state == WORKING)
		uv_timer_stop(&w->work);
	h->state = FREE;
	w->load->revoked++;
	add_wish(w, load_now());
	work_on(w);
}

/* ---- the connection */

static void on_beat(uv_timer_t *t)
{
	struct load_worker *w = t->data;
	Farm__Heartbeat b;
	Farm__Envelope m;
	farm__heartbeat__init(&b);
	farm__envelope__init(&m);
	m.heartbeat = &b;
	w->beat_at = load_now();
	send_message(w, &m, FARM__ENVELOPE__BODY_HEARTBEAT);
}

static void take_welcome(struct load_worker *w, const Farm__HelloAck *ack)
{
	struct load *l = w->load;
	if (!ack->accepted) {
		fail_worker(w, ack->text);
		return;
	}
	l->connected++;
	if (w->kind == LOAD_HOARDS) {
		uv_timer_start(&w->beat, on_beat, ack->heartbeat_ms, ack->heartbeat_ms);
		request_leases(w, HOARD + 1);
		return;
	}
	uv_timer_start(&w->beat, on_beat, (uint64_t)((double)ack->heartbeat_ms * load_uniform(l)) + 1,
		       ack->heartbeat_ms);
	for (unsigned i = 0; i < l->s.want; i++)
		add_wish(w, load_now());
	request_leases(w, l->s.want);
}

static void take_beat(struct load_worker *w)
{
	if (w->load->measuring && w->beat_at > 0)
		load_times_add(&w->load->beat, 1000 * (load_now() - w->beat_at));
	w->beat_at = 0;
}

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct load_worker *w = user;
	const Farm__Envelope *m = env->message;
	(void)payload;
	(void)size;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HELLO_ACK:
		take_welcome(w, m->hello_ack);
		break;
	case FARM__ENVELOPE__BODY_HEARTBEAT:
		take_beat(w);
		break;
	case FARM__ENVELOPE__BODY_LEASE_GRANT:
		take_grant(w, m->lease_grant);
		break;
	case FARM__ENVELOPE__BODY_LEASE_ACK:
		take_ack(w, m->lease_ack);
		break;
	case FARM__ENVELOPE__BODY_LEASE_REVOKE:
		take_revoke(w, m->lease_revoke);
		break;
	case FARM__ENVELOPE__BODY_JOB_INFO:
		take_job(w, m->job_info);
		break;
	case FARM__ENVELOPE__BODY_BLOB_CHUNK:
		if (*m->blob_chunk->error)
			fail_worker(w, m->blob_chunk->error);
		break;
	case FARM__ENVELOPE__BODY_FAULT:
		if (w->kind != LOAD_HANGS) /* a worker that hangs must time out */
			fail_worker(w, m->fault->text);
		break;
	case FARM__ENVELOPE__BODY_JOB_END:
		fail_worker(w, "a job has ended");
		break;
	default:
		fail_worker(w, "a message that no worker is sent");
	}
}

static void on_opened(void *user)
{
	struct load_worker *w = user;
	char name[32], fingerprint[] = "load 1";
	Farm__Hello h;
	Farm__Envelope m;
	farm__hello__init(&h);
	farm__envelope__init(&m);
	snprintf(name, sizeof name, "load%u", w->index);
	h.version = FARM_VERSION;
	h.role = FARM__ROLE__ROLE_WORKER;
	h.name = name;
	h.fingerprint = fingerprint;
	h.threads = w->kind == LOAD_HOARDS ? HOARD : 1;
	m.hello = &h;
	send_message(w, &m, FARM__ENVELOPE__BODY_HELLO);
}

static void on_drained(void *user)
{
	struct load_worker *w = user;
	double now = load_now();
	for (int i = 0; i < LEASES; i++)
		if (w->held[i].state == SENDING) {
			if (w->load->measuring)
				load_times_add(&w->load->send, 1000 * (now - w->held[i].since));
			w->held[i].state = SENT;
			w->held[i].since = now;
		}
	for (unsigned i = 0; i < w->wishes; i++)
		if (isnan(w->wish[i]))
			w->wish[i] = now;
}

/* Called for both timers: a worker that died or hung connects again, as a restart of the same worker. */
static void on_timer_closed(uv_handle_t *h)
{
	struct load_worker *w = h->data;
	struct load *l = w->load;
	unsigned index = w->index;
	if (--w->closing || l->leaving || (w->kind != LOAD_DIES && w->kind != LOAD_HANGS))
		return;
	*w = (struct load_worker){0};
	load_connect(l, index);
}

static void on_closed(void *user, const char *why)
{
	struct load_worker *w = user;
	struct load *l = w->load;
	w->conn = NULL;
	w->closing = 2;
	uv_close((uv_handle_t *)&w->work, on_timer_closed);
	uv_close((uv_handle_t *)&w->beat, on_timer_closed);
	if (w->kind == LOAD_DIES || w->kind == LOAD_HANGS) {
		l->connected--;
		return;
	}
	if (!l->leaving) {
		l->closed++;
		fail_worker(w, why);
	}
}

struct load_worker *load_workers_new(unsigned count)
{
	return mem_alloc(count, sizeof(struct load_worker));
}

static enum load_kind kind_of(const struct load_settings *s, unsigned index)
{
	unsigned from_last = s->workers - 1 - index;
	for (int k = LOAD_KINDS - 1; k > LOAD_HONEST; k--) {
		if (from_last < s->bad[k])
			return (enum load_kind)k;
		from_last -= s->bad[k];
	}
	return LOAD_HONEST;
}

void load_connect(struct load *l, unsigned index)
{
	static const struct conn_events events = {
		.opened = on_opened, .message = on_message, .drained = on_drained, .closed = on_closed};
	struct conn_config config = {{HEADER_LIMIT, PAYLOAD_LIMIT}, SEND_LIMIT, 600, 0, l->tls, NULL, NULL};
	struct load_worker *w = &l->workers[index];
	struct error e;
	w->load = l;
	w->index = index;
	w->first = true;
	w->kind = kind_of(&l->s, index);
	uv_timer_init(&l->loop, &w->work);
	uv_timer_init(&l->loop, &w->beat);
	w->work.data = w->beat.data = w;
	if (conn_connect(&w->conn, &l->loop, &l->address, &config, &events, w, &e))
		load_die("%s", e.text);
}

void load_leave(struct load *l)
{
	l->leaving = true;
	for (unsigned i = 0; i < l->s.workers; i++) {
		struct load_worker *w = &l->workers[i];
		if (!w->conn)
			continue;
		uv_timer_stop(&w->work);
		request_leases(w, 0);
		for (int k = 0; k < LEASES; k++)
			if (w->held[k].state == WAITING || w->held[k].state == WORKING)
				give_back(w, &w->held[k]);
	}
}

unsigned load_unanswered(const struct load *l)
{
	unsigned n = 0;
	for (unsigned i = 0; i < l->s.workers; i++)
		for (int k = 0; k < LEASES; k++)
			n += l->workers[i].held[k].state >= SENDING;
	return n;
}

void load_close(struct load *l)
{
	for (unsigned i = 0; i < l->s.workers; i++)
		if (l->workers[i].conn)
			conn_close(l->workers[i].conn, "over");
}
