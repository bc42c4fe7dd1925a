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

enum { HOARDED_THREADS = 4096 };
enum { LEASES_MAX = 8, REQUESTS_MAX = 8, HEADER_LIMIT = 1 << 22, PAYLOAD_LIMIT = 1 << 28, SEND_LIMIT = 1 << 30 };
enum lease_state { FREE, WAITING, WORKING, SENDING, SENT };

struct held_lease {
	enum lease_state state;
	struct lease_key key;
	double state_since; /* s; SENDING: when sending began; SENT: when all of it was handed over */
};

struct load_worker {
	struct load *load;
	struct conn *conn; /* NULL: not connected */
	uv_timer_t work_timer, heartbeat_timer;
	unsigned index;
	int closing_timers; /* timers of the closed connection that still have to close */
	enum load_behaviour kind;
	bool is_hanging;
	uint64_t jobs_ready; /* bit set: jobs whose files the worker has */
	uint64_t jobs_requested;
	struct held_lease held[LEASES_MAX];
	double request_times[REQUESTS_MAX]; /* for each lease it waits for, when it could have been granted; NAN: not
					       yet */
	unsigned request_count;
	double heartbeat_sent; /* 0: the heartbeat was answered */
	bool is_first_render, has_had_grant;
};

static void begin_next_lease(struct load_worker *w);

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
		snprintf(l->first_fault, sizeof l->first_fault, "worker %u: %s", w->index, text);
}

static void add_request(struct load_worker *w, double time)
{
	if (w->request_count < REQUESTS_MAX)
		w->request_times[w->request_count++] = time;
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

static void return_lease(struct load_worker *w, struct held_lease *h)
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
	w->load->returned++;
}

/* ---- jobs and their files */

static struct load_job *find_job(const struct load *l, uint64_t id, unsigned *index)
{
	for (unsigned i = 0; i < l->job_count; i++)
		if (l->jobs[i].id == id) {
			*index = i;
			return &l->jobs[i];
		}
	return NULL;
}

static void request_job(struct load_worker *w, uint64_t job)
{
	Farm__JobGet get;
	Farm__Envelope m;
	farm__job_get__init(&get);
	farm__envelope__init(&m);
	get.job = job;
	m.job_get = &get;
	send_message(w, &m, FARM__ENVELOPE__BODY_JOB_GET);
}

static void request_file(struct load_worker *w, const Farm__File *f)
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
static void handle_job_info(struct load_worker *w, const Farm__JobInfo *info)
{
	struct load *l = w->load;
	struct error e;
	unsigned i;
	struct load_job *j = find_job(l, info->job, &i);
	struct plan p;
	if (!j || info->n_files != 1 || plan_from_wire(info->plan, &p, &e)) {
		fail_worker(w, "a job that is not one of ours");
		return;
	}
	if (!j->has_plan && (p.groups * p.parts != j->plan.groups * j->plan.parts || p.epoch != j->plan.epoch))
		load_die("the coordinator has made another plan");
	j->has_plan = true;
	request_file(w, info->files[0]);
	w->jobs_ready |= UINT64_C(1) << i;
	begin_next_lease(w);
}

/* ---- leases */

static struct held_lease *find_lease(struct load_worker *w, const struct lease_key *k)
{
	for (int i = 0; i < LEASES_MAX; i++) {
		struct held_lease *h = &w->held[i];
		if (h->state != FREE && h->key.job == k->job && h->key.kind == k->kind && h->key.group == k->group &&
		    h->key.part == k->part && h->key.epoch == k->epoch)
			return h;
	}
	return NULL;
}

static struct held_lease *find_in_state(struct load_worker *w, enum lease_state state)
{
	for (int i = 0; i < LEASES_MAX; i++)
		if (w->held[i].state == state)
			return &w->held[i];
	return NULL;
}

static void send_result(struct load_worker *w, struct held_lease *h)
{
	struct load *l = w->load;
	size_t size;
	unsigned char *frame = load_content_frame(l->content, &h->key, &size);
	h->state = SENDING;
	h->state_since = load_now();
	add_request(w, NAN);
	if (w->kind == LOAD_LYING) {
		memset(frame + size / 2, 0xff, 64); /* pixels that are not numbers */
		l->lies++;
	}
	if (l->is_measuring) {
		l->batches++;
		l->bytes += size;
	}
	conn_send_frame(w->conn, frame, size);
}

/* Returns true if the worker disconnects instead of sending a finished result. It does not do so while the answer to
 * another result is under way, which would not be counted. */
static bool misbehaves(struct load_worker *w)
{
	struct load *l = w->load;
	if ((w->kind != LOAD_DYING && w->kind != LOAD_HANGING) || find_in_state(w, SENDING) || find_in_state(w, SENT) ||
	    load_uniform(l) > 1. / 3)
		return false;
	if (w->kind == LOAD_DYING) {
		l->deaths++;
		conn_close(w->conn, "dies");
	} else {
		l->hangs++;
		w->is_hanging = true;
		uv_timer_stop(&w->heartbeat_timer);
	}
	return true;
}

static void on_work_done(uv_timer_t *t)
{
	struct load_worker *w = t->data;
	struct held_lease *h = find_in_state(w, WORKING);
	if (w->is_hanging || (h && w->conn && misbehaves(w)))
		return;
	if (h && w->conn)
		send_result(w, h);
	begin_next_lease(w);
}

static void begin_next_lease(struct load_worker *w)
{
	struct load *l = w->load;
	unsigned i = 0;
	struct held_lease *h =
		l->is_leaving || w->is_hanging || find_in_state(w, WORKING) ? NULL : find_in_state(w, WAITING);
	if (!h || !find_job(l, h->key.job, &i) || !(w->jobs_ready >> i & 1))
		return;
	h->state = WORKING;
	/* Leases of the bootstrap are short; workers begin their first render lease at different times, which spreads
	 * the crowd over the interval. */
	double seconds = l->settings.interval_seconds * (0.9 + 0.2 * load_uniform(l));
	if (h->key.kind == LEASE_BOOTSTRAP)
		seconds = fmin(1, seconds) * (0.5 + 0.5 * load_uniform(l));
	else if (w->is_first_render)
		seconds += l->settings.interval_seconds * load_uniform(l);
	w->is_first_render = w->is_first_render && h->key.kind == LEASE_BOOTSTRAP;
	uv_timer_start(&w->work_timer, on_work_done, (uint64_t)(1000 * seconds) + 1, 0);
}

static void handle_grant(struct load_worker *w, const Farm__LeaseGrant *m)
{
	struct load *l = w->load;
	struct error e;
	unsigned i;
	struct held_lease *h = find_in_state(w, FREE);
	struct lease_key k;
	if (w->kind == LOAD_HOARDING) {
		l->hoarded++;
		return;
	}
	if (!h || lease_key_from_wire(m->key, &k, &e) || !find_job(l, k.job, &i)) {
		fail_worker(w, "a lease that cannot be");
		return;
	}
	if (find_lease(w, &k)) { /* the lease was overdue, and no other worker is free */
		l->granted_again++;
		return;
	}
	l->grants++;
	double now = load_now();
	if (w->request_count) {
		double request_time = w->request_times[0], ms = isnan(request_time) ? 0 : 1000 * (now - request_time);
		memmove(w->request_times, w->request_times + 1, --w->request_count * sizeof *w->request_times);
		if (l->is_measuring)
			load_times_add(w->has_had_grant ? &l->grant_times : &l->first_grant_times, ms);
		else if (!w->has_had_grant)
			load_times_add(&l->first_grant_times, ms);
		w->has_had_grant = true;
	}
	*h = (struct held_lease){.state = WAITING, .key = k};
	if (!(w->jobs_requested >> i & 1)) {
		w->jobs_requested |= UINT64_C(1) << i;
		request_job(w, k.job);
	}
	begin_next_lease(w);
}

/* Each epoch of a slot must come once, in order. */
static void count_merged(struct load *l, const struct lease_key *k)
{
	unsigned i;
	struct load_job *j = find_job(l, k->job, &i);
	if (k->kind == LEASE_BOOTSTRAP) {
		l->bootstrap_merged++;
		return;
	}
	l->merged++;
	uint64_t *epoch = &j->acknowledged_epochs[k->group * j->plan.parts + k->part];
	l->out_of_order += k->epoch != *epoch;
	*epoch = k->epoch + 1;
}

static void handle_ack(struct load_worker *w, const Farm__LeaseAck *m)
{
	struct load *l = w->load;
	struct error e;
	struct lease_key k;
	struct held_lease *h = lease_key_from_wire(m->key, &k, &e) ? NULL : find_lease(w, &k);
	if (!h || h->state < SENDING) {
		fail_worker(w, "an answer to nothing");
		return;
	}
	l->lies_merged += w->kind == LOAD_LYING && m->verdict == FARM__VERDICT__VERDICT_MERGED;
	if (m->verdict == FARM__VERDICT__VERDICT_MERGED)
		count_merged(l, &k);
	else if (m->verdict == FARM__VERDICT__VERDICT_REPEATED)
		l->repeated++;
	else if (w->kind == LOAD_LYING)
		l->lies_refused++;
	else {
		l->refused++;
		fail_worker(w, m->text);
	}
	if (l->is_measuring)
		load_times_add(&l->ack_times, 1000 * (load_now() - h->state_since));
	h->state = FREE;
}

static void handle_revoke(struct load_worker *w, const Farm__LeaseRevoke *m)
{
	struct error e;
	struct lease_key k;
	struct held_lease *h = lease_key_from_wire(m->key, &k, &e) ? NULL : find_lease(w, &k);
	if (!h || h->state > WORKING) /* its result is under way and will count as a repeat */
		return;
	if (h->state == WORKING)
		uv_timer_stop(&w->work_timer);
	h->state = FREE;
	w->load->revoked++;
	add_request(w, load_now());
	begin_next_lease(w);
}

/* ---- the connection */

static void on_heartbeat_timer(uv_timer_t *t)
{
	struct load_worker *w = t->data;
	Farm__Heartbeat b;
	Farm__Envelope m;
	farm__heartbeat__init(&b);
	farm__envelope__init(&m);
	m.heartbeat = &b;
	w->heartbeat_sent = load_now();
	send_message(w, &m, FARM__ENVELOPE__BODY_HEARTBEAT);
}

static void handle_hello_ack(struct load_worker *w, const Farm__HelloAck *ack)
{
	struct load *l = w->load;
	if (!ack->accepted) {
		fail_worker(w, ack->text);
		return;
	}
	l->connected_count++;
	if (w->kind == LOAD_HOARDING) {
		uv_timer_start(&w->heartbeat_timer, on_heartbeat_timer, ack->heartbeat_ms, ack->heartbeat_ms);
		request_leases(w, HOARDED_THREADS + 1);
		return;
	}
	uv_timer_start(&w->heartbeat_timer, on_heartbeat_timer,
		       (uint64_t)((double)ack->heartbeat_ms * load_uniform(l)) + 1, ack->heartbeat_ms);
	for (unsigned i = 0; i < l->settings.leases_per_worker; i++)
		add_request(w, load_now());
	request_leases(w, l->settings.leases_per_worker);
}

static void handle_heartbeat(struct load_worker *w)
{
	if (w->load->is_measuring && w->heartbeat_sent > 0)
		load_times_add(&w->load->heartbeat_times, 1000 * (load_now() - w->heartbeat_sent));
	w->heartbeat_sent = 0;
}

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct load_worker *w = user;
	const Farm__Envelope *m = env->message;
	(void)payload;
	(void)size;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HELLO_ACK:
		handle_hello_ack(w, m->hello_ack);
		break;
	case FARM__ENVELOPE__BODY_HEARTBEAT:
		handle_heartbeat(w);
		break;
	case FARM__ENVELOPE__BODY_LEASE_GRANT:
		handle_grant(w, m->lease_grant);
		break;
	case FARM__ENVELOPE__BODY_LEASE_ACK:
		handle_ack(w, m->lease_ack);
		break;
	case FARM__ENVELOPE__BODY_LEASE_REVOKE:
		handle_revoke(w, m->lease_revoke);
		break;
	case FARM__ENVELOPE__BODY_JOB_INFO:
		handle_job_info(w, m->job_info);
		break;
	case FARM__ENVELOPE__BODY_BLOB_CHUNK:
		if (*m->blob_chunk->error)
			fail_worker(w, m->blob_chunk->error);
		break;
	case FARM__ENVELOPE__BODY_FAULT:
		if (w->kind != LOAD_HANGING) /* a worker that hangs must time out */
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
	h.threads = w->kind == LOAD_HOARDING ? HOARDED_THREADS : 1;
	m.hello = &h;
	send_message(w, &m, FARM__ENVELOPE__BODY_HELLO);
}

static void on_drained(void *user)
{
	struct load_worker *w = user;
	double now = load_now();
	for (int i = 0; i < LEASES_MAX; i++)
		if (w->held[i].state == SENDING) {
			if (w->load->is_measuring)
				load_times_add(&w->load->send_times, 1000 * (now - w->held[i].state_since));
			w->held[i].state = SENT;
			w->held[i].state_since = now;
		}
	for (unsigned i = 0; i < w->request_count; i++)
		if (isnan(w->request_times[i]))
			w->request_times[i] = now;
}

/* Called for both timers: a worker that died or hung connects again, as a restart of the same worker. */
static void on_timer_closed(uv_handle_t *h)
{
	struct load_worker *w = h->data;
	struct load *l = w->load;
	unsigned index = w->index;
	if (--w->closing_timers || l->is_leaving || (w->kind != LOAD_DYING && w->kind != LOAD_HANGING))
		return;
	*w = (struct load_worker){0};
	load_connect(l, index);
}

static void on_closed(void *user, const char *why)
{
	struct load_worker *w = user;
	struct load *l = w->load;
	w->conn = NULL;
	w->closing_timers = 2;
	uv_close((uv_handle_t *)&w->work_timer, on_timer_closed);
	uv_close((uv_handle_t *)&w->heartbeat_timer, on_timer_closed);
	if (w->kind == LOAD_DYING || w->kind == LOAD_HANGING) {
		l->connected_count--;
		return;
	}
	if (!l->is_leaving) {
		l->disconnected++;
		fail_worker(w, why);
	}
}

struct load_worker *load_workers_new(unsigned count)
{
	return mem_alloc(count, sizeof(struct load_worker));
}

static enum load_behaviour worker_behaviour(const struct load_settings *s, unsigned index)
{
	unsigned from_last = s->workers - 1 - index;
	for (int k = LOAD_BEHAVIOURS - 1; k > LOAD_HONEST; k--) {
		if (from_last < s->misbehaving[k])
			return (enum load_behaviour)k;
		from_last -= s->misbehaving[k];
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
	w->is_first_render = true;
	w->kind = worker_behaviour(&l->settings, index);
	uv_timer_init(&l->loop, &w->work_timer);
	uv_timer_init(&l->loop, &w->heartbeat_timer);
	w->work_timer.data = w->heartbeat_timer.data = w;
	if (conn_connect(&w->conn, &l->loop, &l->address, &config, &events, w, &e))
		load_die("%s", e.text);
}

void load_wind_down(struct load *l)
{
	l->is_leaving = true;
	for (unsigned i = 0; i < l->settings.workers; i++) {
		struct load_worker *w = &l->workers[i];
		if (!w->conn)
			continue;
		uv_timer_stop(&w->work_timer);
		request_leases(w, 0);
		for (int k = 0; k < LEASES_MAX; k++)
			if (w->held[k].state == WAITING || w->held[k].state == WORKING)
				return_lease(w, &w->held[k]);
	}
}

unsigned load_unacknowledged_count(const struct load *l)
{
	unsigned n = 0;
	for (unsigned i = 0; i < l->settings.workers; i++)
		for (int k = 0; k < LEASES_MAX; k++)
			n += l->workers[i].held[k].state >= SENDING;
	return n;
}

void load_disconnect_all(struct load *l)
{
	for (unsigned i = 0; i < l->settings.workers; i++)
		if (l->workers[i].conn)
			conn_close(l->workers[i].conn, "over");
}
