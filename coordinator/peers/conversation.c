/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The protocol of one connection: its handshake, then messages as a worker (worker.c) or as a client (client.c).
 *
 * The first message must be hello, within a time limit, and at most 4 KiB long. Version, names and the certificate's
 * role are checked; a peer that is refused gets a sentence, and a worker is also told whether reconnecting can help.
 * Then a worker asks for leases, sends results or failures, asks for files, and sends heartbeats; each message
 * becomes an event for the core, and each result is checked first (results.c).
 *
 * An invalid message is answered by Fault, and the connection ends. The data that a peer has not read is bounded by a
 * send limit for each peer, and by another for all peers together: beyond it, those that have not read for longest
 * are disconnected. When the maximum number of connections is reached, the oldest one without a hello is closed. When
 * a connection ends, the core gets EVENT_LEFT, and the peer's uploads, fetches and requests are dropped.
 */
#include "coordinator/peers/conversation.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/jobs/extend.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/jobs/results.h"
#include "coordinator/jobs/step.h"
#include "coordinator/peers/client.h"
#include "coordinator/peers/fetch.h"
#include "coordinator/peers/request_queue.h"
#include "coordinator/peers/worker.h"
#include "coordinator/peers/worker_requests.h"

#include <stdio.h>
#include <string.h>

/* is_permanent: reconnecting will not help. reason: why the peer is refused, or a note for a peer that is accepted. */
static void answer_hello(struct session *p, bool accepted, bool is_permanent, const char *reason)
{
	char text[256];
	text_copy(text, sizeof text, reason);
	conn_send(p->conn,
		  ENVELOPE(HELLO_ACK, hello_ack, .accepted = accepted, .final = is_permanent, .text = text,
			   .version = FARM_VERSION,
			   .heartbeat_ms = (uint32_t)(1000 * p->jobs->config.heartbeat_seconds)),
		  NULL, 0);
	if (!accepted) {
		log_event(LOG_PEER_REFUSED, "peer=%llu address=%s name=%s text=%s", (unsigned long long)p->id,
			  p->address, log_quote(p->name).text, log_quote(text).text);
		p->state = SESSION_LEAVING;
		conn_close_when_sent(p->conn, text);
	}
}

/* Refuses a peer for a reason that reconnecting does not change. */
static void refuse_permanently(struct session *p, const char *reason)
{
	answer_hello(p, false, true, reason);
}

/* Writes notes for a peer that is accepted. */
static const char *write_peer_notes(const struct session *p, char *text, size_t size)
{
	struct peer_status s;
	*text = 0;
	if (recovery_is_running(p->jobs))
		text_print(text, size,
			   "the coordinator is reading its jobs, %u %%: requests wait until it has finished",
			   (unsigned)(100 * recovery_progress(p->jobs)));
	if (p->is_known_to_core && farm_peer_status(p->jobs->farm, p->id, &s) && s.state == PEER_QUARANTINED)
		text_print(text, size, "this worker is quarantined and gets no work: %s", s.last_fault);
	return text;
}

static void join_worker(struct session *p, const Farm__Hello *h)
{
	char text[256];
	struct error e;
	struct event ev = {.kind = EVENT_JOINED,
			   .peer = p->id,
			   .join = {.peer = p->id,
				    .name = p->name,
				    .fingerprint = h->fingerprint,
				    .threads = h->threads,
				    .certificate = p->tls_peer.name,
				    .home = h->home,
				    .restarts = h->restarts}};
	p->is_known_to_core = true;
	if (jobs_try_step(p->jobs, &ev, &(struct incoming){0}, &e)) {
		p->is_known_to_core = false;
		answer_hello(p, false, false, e.text);
		return;
	}
	p->state = SESSION_WORKER;
	log_event(
		LOG_PEER_HELLO,
		"peer=%llu address=%s role=worker name=%s certificate=%s home=%s start=%llu threads=%u fingerprint=%s",
		(unsigned long long)p->id, p->address, log_quote(p->name).text,
		*p->tls_peer.name ? p->tls_peer.name : "-", *h->home ? h->home : "-", (unsigned long long)h->restarts,
		h->threads, log_quote(h->fingerprint).text);
	answer_hello(p, true, false, write_peer_notes(p, text, sizeof text));
}

/* Returns what the peer wants to do but its certificate does not allow; NULL: nothing. Sets p->tls_peer. */
static const char *find_forbidden_request(struct session *p, Farm__Role role, char *text, size_t size)
{
	const struct tls_peer *who = conn_peer(p->conn);
	if (!who)
		return NULL;
	p->tls_peer = *who;
	bool is_allowed = role == FARM__ROLE__ROLE_WORKER ? who->role == TLS_WORKER
							  : who->role == TLS_CLIENT || who->role == TLS_OPERATOR;
	if (is_allowed)
		return NULL;
	snprintf(text, size, "the certificate of %s is a %s's: it cannot %s", who->name, tls_role_name(who->role),
		 role == FARM__ROLE__ROLE_WORKER ? "take leases" : "submit or manage jobs");
	return text;
}

/* Whether a home's name is hexadecimal digits, and no longer than the core can store. */
static bool is_valid_home(const char *home)
{
	size_t n = strspn(home, "0123456789abcdef");
	return !home[n] && n < JOIN_HOME_SIZE;
}

static void handle_hello(struct session *p, const Farm__Hello *h)
{
	char text[192];
	if (h->version != FARM_VERSION) {
		const char *who = h->role == FARM__ROLE__ROLE_WORKER ? "worker" : "client";
		snprintf(
			text, sizeof text,
			"the %s speaks version %u of the protocol, the coordinator version %d: the %s is older and must "
			"be updated",
			who, h->version, FARM_VERSION, h->version < FARM_VERSION ? who : "coordinator");
		refuse_permanently(p, text);
		return;
	}
	if (!envelope_text_is_valid(h->name, sizeof p->name - 1) || !envelope_text_is_valid(h->fingerprint, 255) ||
	    !is_valid_home(h->home) || h->threads > 4096) {
		refuse_permanently(p, "a name or a number in hello is out of bounds");
		return;
	}
	text_copy(p->name, sizeof p->name, h->name);
	const char *overreach = find_forbidden_request(p, h->role, text, sizeof text);
	if (overreach) {
		refuse_permanently(p, overreach);
		return;
	}
	conn_set_limits(p->conn, (struct frame_limits){SESSION_HEADER_MAX, 0});
	conn_set_send_limit(p->conn, SESSION_SEND_MAX);
	conn_set_idle_timeout(p->conn, 6 * p->jobs->config.heartbeat_seconds);
	if (h->role == FARM__ROLE__ROLE_WORKER) {
		join_worker(p, h);
	} else if (h->role == FARM__ROLE__ROLE_CLIENT) {
		p->state = SESSION_CLIENT;
		answer_hello(p, true, false, write_peer_notes(p, text, sizeof text));
	} else {
		refuse_permanently(p, "hello must say whether it is a worker or a client");
	}
}

/* Handles a message. May take over the envelope. */
static void handle_message(struct session *p, struct envelope *env, const unsigned char *payload, size_t size)
{
	if (p->state == SESSION_NEW && env->message->body_case == FARM__ENVELOPE__BODY_HELLO)
		handle_hello(p, env->message->hello);
	else if (p->state == SESSION_NEW)
		session_fault(p, "the first message must be hello");
	else if (p->state == SESSION_WORKER)
		worker_handle_message(p, env);
	else if (p->state == SESSION_CLIENT)
		client_handle_message(p, env, payload, size);
}

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct session *p = user;
	bool has_role = p->state == SESSION_WORKER || p->state == SESSION_CLIENT;
	Farm__Envelope__BodyCase what = env->message->body_case; /* read now, because the envelope may be taken over */
	double begun = jobs_now(p->jobs);
	if (has_role && request_queue_defer(p, env))
		return;
	handle_message(p, env, payload, size);
	request_queue_note_handled(p, what, begun);
}

static void handle_queued(struct session *p)
{
	struct envelope env;
	if (!request_queue_pop(p, &env))
		return;
	Farm__Envelope__BodyCase what = env.message->body_case;
	double begun = jobs_now(p->jobs);
	handle_message(p, &env, NULL, 0);
	request_queue_note_handled(p, what, begun);
	envelope_fini(&env);
}

void conversations_resume(struct peers *s)
{
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		while (p->state == SESSION_WORKER && !STAILQ_EMPTY(&p->queued_requests))
			handle_queued(p);
	conversations_tick(s);
}

void conversations_tick(struct peers *s)
{
	s->request_ms_this_tick = 0;
	if (recovery_is_running(s->jobs))
		return;
	for (struct session *p; (p = request_queue_next_session(s));)
		handle_queued(p);
}

static void on_closed(void *user, const char *why)
{
	struct session *p = user;
	struct peers *s = p->peers;
	if (!p->jobs->is_stopping)
		results_release_peer(p->jobs, p->id); /* while the session still has a name */
	peers_remove_session(s, p);
	client_abort_upload(p);
	fetch_end(p);
	worker_requests_drop(p);
	request_queue_drop(p);
	extend_forget_peer(p->jobs, p->id);
	s->bad_checksum_count += conn_had_bad_checksum(p->conn);
	log_event(conn_had_bad_checksum(p->conn)    ? LOG_PEER_GARBLED
		  : conn_certificate_error(p->conn) ? LOG_PEER_REFUSED
		  : conn_was_evicted(p->conn)	    ? LOG_PEER_REFUSED
		  : p->state == SESSION_WORKER	    ? LOG_PEER_CLOSED
						    : LOG_PEER_ACCEPT,
		  "peer=%llu address=%s name=%s text=%s", (unsigned long long)p->id, p->address,
		  log_quote(p->name).text, log_quote(why).text);
	if (p->is_known_to_core && !p->jobs->is_stopping) {
		struct event ev = {.kind = EVENT_LEFT, .peer = p->id, .text = why};
		jobs_step(p->jobs, &ev);
	}
	mem_free(p->last_sent_status);
	mem_free(p);
}

const struct conn_events conversation_events = {
	.message = on_message, .partial = worker_note_partial, .drained = worker_requests_resume, .closed = on_closed};
