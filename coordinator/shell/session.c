/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One connection: its handshake, the messages of a worker, and what is sent to it. Clients' messages are in client.c.
 *
 * The first message must be hello, within a time limit, and at most 4 KiB long. Version, names and the certificate's
 * role are checked; whoever is refused gets a sentence, and a worker also hears whether calling again can help. A
 * worker then asks for leases, sends results or failures, asks for files, and sends heartbeats; each message becomes an
 * event for the core, and each result is checked first (results.c).
 *
 * A message that its sender must not send is answered by Fault, and the connection ends. What a peer does not read is
 * bounded by a send limit. When the maximum of connections is reached the oldest one without a hello is closed. When a
 * connection ends, the core hears EVENT_LEFT, and uploads, fetches and requests of that peer are dropped.
 */
#include "coordinator/shell/session.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/shell/worker_requests.h"
#include "coordinator/shell/back.h"
#include "coordinator/shell/files.h"
#include "coordinator/shell/held.h"
#include "coordinator/shell/incoming.h"
#include "coordinator/shell/recovery.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum {
	HELLO_HEADER = 4096,
	HEADER_LIMIT = 1 << 20,
	/* What may wait for a peer to read it: a word to a stranger, answers; for a worker the leases beside that it
	   may hold. */
	HELLO_SEND = 1 << 16,
	PEER_SEND = 1 << 23,
};

void session_send(struct session *p, const Farm__Envelope *m, const void *payload, size_t size)
{
	conn_send(p->conn, m, payload, size);
}

void session_fault(struct session *p, const char *format, ...)
{
	char text[512];
	Farm__Fault fault;
	Farm__Envelope m;
	va_list ap;
	va_start(ap, format);
	vsnprintf(text, sizeof text, format, ap);
	va_end(ap);
	text_clean(text);
	farm__fault__init(&fault);
	farm__envelope__init(&m);
	fault.text = text;
	m.body_case = FARM__ENVELOPE__BODY_FAULT;
	m.fault = &fault;
	log_event(LOG_PEER_FAULT, "peer=%llu address=%s name=%s text=%s", (unsigned long long)p->id, p->address,
		  log_quote(p->name).text, log_quote(text).text);
	session_send(p, &m, NULL, 0);
	p->state = SESSION_LEAVING;
	conn_close_when_sent(p->conn, text);
}

struct session *session_find(const struct server *s, uint64_t id)
{
	for (struct session *p = s->by_id[id % SESSION_BUCKETS]; p; p = p->alike)
		if (p->id == id)
			return p;
	return NULL;
}

static void enlist(struct server *s, struct session *p)
{
	struct session **bucket = &s->by_id[p->id % SESSION_BUCKETS];
	p->alike = *bucket;
	*bucket = p;
	p->next = s->sessions;
	p->place = &s->sessions;
	if (p->next)
		p->next->place = &p->next;
	s->sessions = p;
	s->session_count++;
}

static void delist(struct server *s, struct session *p)
{
	struct session **at = &s->by_id[p->id % SESSION_BUCKETS];
	while (*at != p)
		at = &(*at)->alike;
	*at = p->alike;
	*p->place = p->next;
	if (p->next)
		p->next->place = p->place;
	s->session_count--;
}

/* ---- hello ---- */

/* said: why it is refused, or what a peer that is not should know. */
static void answer_hello(struct session *p, bool accepted, bool final, const char *said)
{
	char text[256];
	Farm__HelloAck ack;
	Farm__Envelope m;
	farm__hello_ack__init(&ack);
	farm__envelope__init(&m);
	text_copy(text, sizeof text, said);
	ack.accepted = accepted;
	ack.final = final;
	ack.text = text;
	ack.version = FARM_VERSION;
	ack.heartbeat_ms = (uint32_t)(1000 * p->server->config.heartbeat_seconds);
	m.body_case = FARM__ENVELOPE__BODY_HELLO_ACK;
	m.hello_ack = &ack;
	session_send(p, &m, NULL, 0);
	if (!accepted) {
		log_event(LOG_PEER_REFUSED, "peer=%llu address=%s name=%s text=%s", (unsigned long long)p->id,
			  p->address, log_quote(p->name).text, log_quote(text).text);
		p->state = SESSION_LEAVING;
		conn_close_when_sent(p->conn, text);
	}
}

static void send_hello_ack(struct session *p, bool accepted, const char *said)
{
	answer_hello(p, accepted, false, said);
}

/* What calling again does not mend. */
static void refuse_for_good(struct session *p, const char *said)
{
	answer_hello(p, false, true, said);
}

/* What a peer that is welcome should know. */
static const char *what_to_know(const struct session *p, char *text, size_t size)
{
	struct peer_status s;
	*text = 0;
	if (recovery_is_on(p->server))
		text_print(text, size,
			   "the coordinator is reading its jobs, %u %%: what is asked for waits until they are there",
			   (unsigned)(100 * recovery_share(p->server)));
	if (p->joined && farm_peer(p->server->farm, p->id, &s) && s.state == PEER_ASIDE)
		text_print(text, size, "this worker is set aside and gets no work: %s", s.text);
	return text;
}

static void join(struct session *p, const Farm__Hello *h)
{
	char text[256];
	struct event ev = {.kind = EVENT_JOINED,
			   .peer = p->id,
			   .join = {.peer = p->id,
				    .name = p->name,
				    .fingerprint = h->fingerprint,
				    .threads = h->threads,
				    .certificate = p->who.name,
				    .home = h->home,
				    .restarts = h->restarts}};
	p->rejected[0] = 0;
	p->joined = true;
	server_step(p->server, &ev);
	if (*p->rejected) {
		p->joined = false;
		send_hello_ack(p, false, p->rejected);
		return;
	}
	p->state = SESSION_WORKER;
	log_event(
		LOG_PEER_HELLO,
		"peer=%llu address=%s role=worker name=%s certificate=%s home=%s start=%llu threads=%u fingerprint=%s",
		(unsigned long long)p->id, p->address, log_quote(p->name).text, *p->who.name ? p->who.name : "-",
		*h->home ? h->home : "-", (unsigned long long)h->restarts, h->threads, log_quote(h->fingerprint).text);
	send_hello_ack(p, true, what_to_know(p, text, sizeof text));
}

/* What the certificate does not allow; NULL: it does. */
static const char *overreach(struct session *p, Farm__Role role, char *text, size_t size)
{
	const struct tls_peer *who = conn_peer(p->conn);
	if (!who)
		return NULL;
	p->who = *who;
	bool may = role == FARM__ROLE__ROLE_WORKER ? who->role == TLS_WORKER
						   : who->role == TLS_CLIENT || who->role == TLS_OPERATOR;
	if (may)
		return NULL;
	snprintf(text, size, "the certificate of %s is a %s's: it cannot %s", who->name, tls_role_name(who->role),
		 role == FARM__ROLE__ROLE_WORKER ? "lease" : "submit or look after jobs");
	return text;
}

/* Hexadecimal digits, as many as the core remembers. */
static bool home_ok(const char *home)
{
	size_t n = strspn(home, "0123456789abcdef");
	return !home[n] && n < JOIN_HOME;
}

static void take_hello(struct session *p, const Farm__Hello *h)
{
	char text[192];
	if (h->version != FARM_VERSION) {
		const char *who = h->role == FARM__ROLE__ROLE_WORKER ? "worker" : "client";
		snprintf(
			text, sizeof text,
			"the %s speaks version %u of the protocol, the coordinator version %u: the %s is older and must be renewed",
			who, h->version, FARM_VERSION, h->version < FARM_VERSION ? who : "coordinator");
		refuse_for_good(p, text);
		return;
	}
	if (!envelope_text_ok(h->name, sizeof p->name - 1) || !envelope_text_ok(h->fingerprint, 255) ||
	    !home_ok(h->home) || h->threads > 4096) {
		refuse_for_good(p, "a name or a number in hello is out of bounds");
		return;
	}
	text_copy(p->name, sizeof p->name, h->name);
	const char *no = overreach(p, h->role, text, sizeof text);
	if (no) {
		refuse_for_good(p, no);
		return;
	}
	conn_set_limits(p->conn, (struct frame_limits){HEADER_LIMIT, 0});
	conn_set_send_limit(p->conn, PEER_SEND);
	conn_set_quiet(p->conn, 6 * p->server->config.heartbeat_seconds);
	if (h->role == FARM__ROLE__ROLE_WORKER) {
		join(p, h);
	} else if (h->role == FARM__ROLE__ROLE_CLIENT) {
		p->state = SESSION_CLIENT;
		send_hello_ack(p, true, what_to_know(p, text, sizeof text));
	} else {
		refuse_for_good(p, "hello must say whether it is a worker or a client");
	}
}

/* ---- a worker speaks ---- */

void session_allow_results(struct session *p, const struct live_job *o)
{
	uint32_t need = batch_payload_max(&o->plan);
	if (need > p->payload_limit) {
		p->payload_limit = need;
		conn_set_limits(p->conn, (struct frame_limits){HEADER_LIMIT, need});
	}
}

/* One that makes an epoch be taken back must not come while others read the films. */
static void take_lease_failed(struct session *p, struct envelope *env)
{
	struct buf nothing = {0};
	if (env->message->lease_failed->bad_states)
		server_result(p->server, p->id, env, &nothing);
	else
		session_lease_failed(p, env->message->lease_failed);
}

/* Who does not hold the lease, or refuses states that it had before, refuses nothing that is there: nobody made it. */
static void log_failure(const struct session *p, struct live_job *o, const Farm__LeaseFailed *f,
			const struct lease_key *k, const char *text, bool holds)
{
	struct log_value name = log_quote(p->name), said = log_quote(text);
	unsigned long long epoch = k->epoch;
	if (f->bad_states)
		live_job_log(o, LOG_LEASE_FAILED,
			     "states_of=%s refused_by=%s text=%s kind=%d group=%u part=%u epoch=%llu",
			     log_quote(holds ? farm_maker(p->server->farm, k) : "?").text, name.text, said.text,
			     (int)k->kind, k->group, k->part, epoch);
	else
		live_job_log(o, LOG_LEASE_FAILED, "worker=%s own=%d text=%s kind=%d group=%u part=%u epoch=%llu",
			     name.text, f->own, said.text, (int)k->kind, k->group, k->part, epoch);
}

void session_lease_failed(struct session *p, const Farm__LeaseFailed *f)
{
	struct error e;
	char text[1024];
	struct blob_hash states = {{0}};
	struct event ev = {.kind = *f->text ? EVENT_LEASE_FAILED : EVENT_LEASE_RETURNED, .peer = p->id, .text = text};
	/* Whatever it says, it failed: many texts of a scene's author are in it. */
	text_copy(text, sizeof text, f->text);
	text_clean(text);
	if (lease_key_from_wire(f->key, &ev.lease.key, &e) ||
	    (f->bad_states && states_digest_from_wire(&f->states_digest, &states, &e))) {
		session_fault(p, "a lease cannot fail like this");
		return;
	}
	ev.job = ev.lease.key.job;
	struct live_job *o = server_live_job(p->server, ev.job);
	ev.lease.own = f->own;
	ev.lease.bad_states = f->bad_states;
	ev.lease.other_states = f->bad_states && !(o && live_job_gives_states(o, &ev.lease.key, &states));
	bool blamed = f->own || f->bad_states;
	if (o && *f->text && !blamed && !files_are_right(p->server, o)) { /* the spool's fault, not the worker's */
		ev.kind = EVENT_LEASE_RETURNED;
		text[0] = 0;
	}
	struct back back = {0};
	bool holds = farm_awaits(p->server->farm, p->id, &ev.lease.key) == DELIVERY_AWAITED &&
		     !ev.lease.other_states; /* else nothing is read for it */
	if (o && *text)
		log_failure(p, o, f, &ev.lease.key, text, holds);
	if (o && *text && f->bad_states && holds && !o->busy && !p->server->stepping &&
	    journal_write(o->journal, &e) == 0)
		ev.lease.can_take_back = back_read(o, o->journal, &ev.lease.key, &back, &e) == 0;
	if (ev.lease.can_take_back)
		server_step_with(p->server, &ev, &(struct incoming){.back = &back});
	else
		server_step(p->server, &ev);
	back_fini(&back);
}

static void take_blob_get(struct session *p, const Farm__BlobGet *g)
{
	struct worker_request a = {.blob = true, .number = g->offset};
	if (g->hash.len != BLOB_HASH_SIZE) {
		session_fault(p, "a blob's name has %zu bytes", g->hash.len);
		return;
	}
	memcpy(a.hash.bytes, g->hash.data, sizeof a.hash.bytes);
	worker_requests_take(p, &a);
}

static void take_lease_result(struct session *p, struct envelope *env)
{
	struct buf payload = conn_take_payload(p->conn);
	server_result(p->server, p->id, env, &payload);
	buf_fini(&payload);
}

/* Also a message that takes long is a word from its worker, who must know for as long that we are here: its heartbeats,
 * and with them our answers, are behind that message. */
static void on_heard(void *user)
{
	struct session *p = user;
	struct event ev = {.kind = EVENT_HEARD, .peer = p->id};
	Farm__Heartbeat beat;
	Farm__Envelope m;
	if (!p->joined || p->state != SESSION_WORKER ||
	    server_now(p->server) < p->heard + p->server->config.heartbeat_seconds)
		return;
	p->heard = server_now(p->server);
	farm__heartbeat__init(&beat);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_HEARTBEAT;
	m.heartbeat = &beat;
	session_send(p, &m, NULL, 0);
	server_step(p->server, &ev);
}

static void worker_message(struct session *p, struct envelope *env)
{
	struct event ev = {.kind = EVENT_HEARD, .peer = p->id};
	const Farm__Envelope *m = env->message;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HEARTBEAT: /* answered, so that a worker notices a connection that is dead */
		session_send(p, m, NULL, 0);
		server_step(p->server, &ev);
		break;
	case FARM__ENVELOPE__BODY_LEASE_REQUEST:
		ev.kind = EVENT_REQUEST;
		ev.want = m->lease_request->want;
		server_step(p->server, &ev);
		break;
	case FARM__ENVELOPE__BODY_LEASE_RESULT:
		server_step(p->server, &ev);
		if (p->joined)
			take_lease_result(p, env);
		break;
	case FARM__ENVELOPE__BODY_LEASE_FAILED:
		take_lease_failed(p, env);
		break;
	case FARM__ENVELOPE__BODY_JOB_GET:
		worker_requests_take(p, &(struct worker_request){.number = m->job_get->job});
		break;
	case FARM__ENVELOPE__BODY_BLOB_GET:
		take_blob_get(p, m->blob_get);
		break;
	case FARM__ENVELOPE__BODY_BYE:
		conn_close(p->conn, "the worker said goodbye");
		break;
	default:
		session_fault(p, "not a message that a worker says");
	}
}

/* ---- the connection ---- */

void session_message(struct session *p, struct envelope *env, const unsigned char *payload, size_t size)
{
	if (p->state == SESSION_NEW && env->message->body_case == FARM__ENVELOPE__BODY_HELLO)
		take_hello(p, env->message->hello);
	else if (p->state == SESSION_NEW)
		session_fault(p, "the first word must be hello");
	else if (p->state == SESSION_WORKER)
		worker_message(p, env);
	else if (p->state == SESSION_CLIENT)
		session_client_message(p, env, payload, size);
}

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct session *p = user;
	bool known = p->state == SESSION_WORKER || p->state == SESSION_CLIENT;
	if (!known || !held_take(p, env))
		session_message(p, env, payload, size);
}

static void on_closed(void *user, const char *why)
{
	struct session *p = user;
	struct server *s = p->server;
	delist(s, p);
	session_upload_abort(p);
	session_fetch_end(p);
	worker_requests_drop(p);
	held_drop(p);
	extend_forget(p);
	s->garbled += conn_garbled(p->conn);
	log_event(conn_garbled(p->conn)	       ? LOG_PEER_GARBLED
		  : conn_distrust(p->conn)     ? LOG_PEER_REFUSED
		  : p->state == SESSION_WORKER ? LOG_PEER_CLOSED
					       : LOG_PEER_ACCEPT,
		  "peer=%llu address=%s name=%s text=%s", (unsigned long long)p->id, p->address,
		  log_quote(p->name).text, log_quote(why).text);
	orders_drop_waiting(s->orders, p->id);
	if (p->joined && !s->stopping) {
		struct event ev = {.kind = EVENT_LEFT, .peer = p->id, .text = why};
		server_step(s, &ev);
	}
	mem_free(p->shown);
	mem_free(p);
}

static void on_drained(void *user)
{
	worker_requests_go_on(user);
}

static const struct conn_events events = {
	.message = on_message, .heard = on_heard, .drained = on_drained, .closed = on_closed};

static void on_refused(void *user, const char *why)
{
	(void)user;
	(void)why;
}
static const struct conn_events refused_events = {.closed = on_refused};

/* Whoever has not said who they are gives way, the one who has had longest first: strangers who hold connections and
 * say nothing must not keep out those who can. */
static bool make_room(struct server *s)
{
	struct session *oldest = NULL;
	for (struct session *p = s->sessions; p; p = p->next)
		if (p->state == SESSION_NEW)
			oldest = p;
	if (!oldest)
		return false;
	oldest->state = SESSION_LEAVING;
	conn_close(oldest->conn, "as many connections as are allowed, and this one has not said hello");
	return true;
}

void session_accept(struct server *s)
{
	struct conn_config config = {
		{HELLO_HEADER, 0}, HELLO_SEND, s->config.stall_seconds, s->config.hello_seconds, s->tls};
	struct error e;
	bool room = s->session_count < s->config.max_connections || make_room(s);
	struct session *p = room ? mem_alloc(1, sizeof *p) : NULL;
	struct conn *c;
	s->caller_waits = false;
	if (!p) {
		log_event(LOG_PEER_REFUSED, "text=\"as many connections as are allowed\"");
		if (conn_accept(&c, (uv_stream_t *)&s->listener, &config, &refused_events, NULL, &e) == 0)
			conn_close(c, "as many connections as are allowed");
		else
			s->caller_waits = true;
		return;
	}
	p->server = s;
	p->id = ++s->last_peer;
	if (conn_accept(&p->conn, (uv_stream_t *)&s->listener, &config, &events, p, &e)) {
		log_event(LOG_PEER_REFUSED, "text=%s", log_quote(e.text).text);
		s->caller_waits = true;
		mem_free(p);
		return;
	}
	conn_peer_name(p->conn, p->address, sizeof p->address);
	enlist(s, p);
	log_event(LOG_PEER_ACCEPT, "peer=%llu address=%s", (unsigned long long)p->id, p->address);
}

/* ---- the core speaks to a worker ---- */

/* As many leases as it wants, of the size of the largest, may wait for it to read them. */
static void allow_lease(struct session *p, size_t size)
{
	struct peer_status s;
	if (!farm_peer(p->server->farm, p->id, &s) || s.want * size <= p->leases_most)
		return;
	p->leases_most = s.want * size;
	conn_set_send_limit(p->conn, PEER_SEND + p->leases_most);
}

void session_send_lease(struct session *p, const struct live_job *o, const struct lease_key *k, bool anew)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	session_allow_results(p, o);
	if (live_job_pack_lease(o, k, anew, &frame, &size, &e)) {
		conn_close(p->conn, e.text);
		return;
	}
	allow_lease(p, size);
	conn_send_frame(p->conn, frame, size);
}

void session_send_revoke(struct session *p, const struct lease_key *k)
{
	Farm__LeaseKey key;
	Farm__LeaseRevoke revoke;
	Farm__Envelope m;
	lease_key_to_wire(k, &key);
	farm__lease_revoke__init(&revoke);
	farm__envelope__init(&m);
	revoke.key = &key;
	m.body_case = FARM__ENVELOPE__BODY_LEASE_REVOKE;
	m.lease_revoke = &revoke;
	session_send(p, &m, NULL, 0);
}

void session_send_ack(struct session *p, const struct lease_key *k, enum ack ack, const char *text)
{
	static const Farm__Verdict verdicts[] = {[ACK_MERGED] = FARM__VERDICT__VERDICT_MERGED,
						 [ACK_REPEAT] = FARM__VERDICT__VERDICT_REPEATED,
						 [ACK_REFUSED] = FARM__VERDICT__VERDICT_REFUSED,
						 [ACK_NOTED] = FARM__VERDICT__VERDICT_NOTED};
	char copy[512];
	Farm__LeaseKey key;
	Farm__LeaseAck answer;
	Farm__Envelope m;
	lease_key_to_wire(k, &key);
	farm__lease_ack__init(&answer);
	farm__envelope__init(&m);
	text_copy(copy, sizeof copy, text);
	answer.key = &key;
	answer.verdict = verdicts[ack];
	answer.text = copy;
	m.body_case = FARM__ENVELOPE__BODY_LEASE_ACK;
	m.lease_ack = &answer;
	session_send(p, &m, NULL, 0);
}

void session_send_job_end(struct session *p, uint64_t job)
{
	Farm__JobEnd end;
	Farm__Envelope m;
	farm__job_end__init(&end);
	farm__envelope__init(&m);
	end.job = job;
	m.body_case = FARM__ENVELOPE__BODY_JOB_END;
	m.job_end = &end;
	session_send(p, &m, NULL, 0);
}

/* ---- watchers ---- */

void session_tick(struct session *p)
{
	struct job_view v;
	struct view_looks looks;
	Farm__JobStatus status;
	Farm__Envelope m;
	if (!p->watched || p->state != SESSION_CLIENT || conn_unsent(p->conn))
		return;
	if (!session_finds_job(p, p->watched, &v)) {
		session_fault(p, "the job is no longer known");
		return;
	}
	if (p->shown && memcmp(p->shown, &v, sizeof v) == 0)
		return;
	if (!p->shown && !(p->shown = mem_alloc(1, sizeof v)))
		return;
	*p->shown = v;
	farm__envelope__init(&m);
	view_to_wire(&v, &status);
	view_looks_to_wire(&v, &looks, &status);
	m.body_case = FARM__ENVELOPE__BODY_JOB_STATUS;
	m.job_status = &status;
	session_send(p, &m, NULL, 0);
	if (record_is_ended(&v.record))
		p->watched = 0;
}
