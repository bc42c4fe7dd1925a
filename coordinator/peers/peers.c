/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All connections: accepting them, and the functions through which the jobs use them.
 *
 * peers_accept makes a session for a connection, which stays in the list until its connection has closed
 * (conversation.c). When the maximum number of connections is reached, the oldest one without a hello is closed. If
 * there is none, or no memory, the new connection is closed; if not even that can be done, it waits for the next
 * tick.
 *
 * The functions that the jobs call are at the end of the file. Each looks for the session, and does nothing if it is
 * gone.
 */
#include "coordinator/peers/peers.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/peers/client.h"
#include "coordinator/peers/client_answers.h"
#include "coordinator/peers/conversation.h"
#include "coordinator/peers/fetch.h"
#include "coordinator/peers/held.h"
#include "coordinator/peers/worker_requests.h"
#include "coordinator/peers/worker_send.h"

static void on_refused(void *user, const char *why)
{
	(void)user;
	(void)why;
}
static const struct conn_events refused_events = {.closed = on_refused};

/* Closes the oldest connection that has not said hello: strangers that hold connections and say nothing must not
 * block others. Returns false if there is none. */
static bool make_room(struct peers *s)
{
	struct session *oldest = NULL;
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		if (p->state == SESSION_NEW)
			oldest = p;
	if (!oldest)
		return false;
	oldest->state = SESSION_LEAVING;
	conn_close(oldest->conn, "too many connections, and this one has not said hello");
	return true;
}

void peers_accept(struct peers *s, struct listener *at)
{
	struct conn_config config = {{SESSION_HELLO_HEADER, 0},
				     SESSION_HELLO_SEND,
				     s->jobs->config.stall_seconds,
				     s->jobs->config.hello_seconds,
				     s->tls,
				     &s->receiving,
				     &s->sending};
	struct error e;
	bool room = s->session_count < s->jobs->config.max_connections || make_room(s);
	struct session *p = room ? mem_alloc(1, sizeof *p) : NULL;
	struct conn *c;
	at->caller_waits = false;
	if (!p) {
		log_event(LOG_PEER_REFUSED, "text=\"too many connections\"");
		if (conn_accept(&c, (uv_stream_t *)&at->tcp, &config, &refused_events, NULL, &e) == 0)
			conn_close(c, "too many connections");
		else
			at->caller_waits = true;
		return;
	}
	p->peers = s;
	p->jobs = s->jobs;
	p->id = ++s->last_peer;
	STAILQ_INIT(&p->requests);
	STAILQ_INIT(&p->held);
	if (conn_accept(&p->conn, (uv_stream_t *)&at->tcp, &config, &conversation_events, p, &e)) {
		log_event(LOG_PEER_REFUSED, "text=%s", log_quote(e.text).text);
		at->caller_waits = true;
		mem_free(p);
		return;
	}
	conn_peer_name(p->conn, p->address, sizeof p->address);
	peers_enlist(s, p);
	log_event(LOG_PEER_ACCEPT, "peer=%llu address=%s", (unsigned long long)p->id, p->address);
}

void peers_tick(struct peers *s)
{
	for (unsigned i = 0; i < s->listener_count; i++)
		if (s->listeners[i].caller_waits)
			peers_accept(s, &s->listeners[i]);
	conversations_tick(s);
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next)) {
		client_tick(p);
		held_tick(p);
	}
}

void peers_stop(struct peers *s)
{
	for (unsigned i = 0; i < s->listener_count; i++)
		uv_close((uv_handle_t *)&s->listeners[i].tcp, NULL);
	uv_close((uv_handle_t *)&s->looks, NULL);
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		conn_close(p->conn, "the coordinator stops");
}

static const char *name(struct peers *s, uint64_t peer)
{
	const struct session *p = peers_find(s, peer);
	return p ? p->name : NULL;
}

static void fault(struct peers *s, uint64_t peer, const char *text)
{
	struct session *p = peers_find(s, peer);
	if (p)
		session_fault(p, "%s", text);
}

static void dismiss_peer(struct peers *s, uint64_t peer, const char *text)
{
	struct session *p = peers_find(s, peer);
	if (!p)
		return;
	p->joined = false;
	session_fault(p, "%s", text);
}

static void extended(struct peers *s, uint64_t peer, const char *refusal, const char *text)
{
	struct session *p = peers_find(s, peer);
	if (p)
		client_send_done(p, refusal, text);
}

static void job_ended(struct peers *s, uint64_t job)
{
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		if (p->state == SESSION_WORKER)
			worker_send_job_end(p, job);
}

static void jobs_let_go(struct peers *s)
{
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		if (p->watched && p->shown && !jobs_find(s->jobs, p->watched))
			client_tick(p);
}

static void file_read(struct peers *s, const struct blob_hash *h, int rc, const char *text)
{
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next)) {
		worker_requests_file_read(p, h, rc ? text : "");
		client_file_read(p, h, rc == 0);
	}
}

static uint64_t uploading(struct peers *s, uint64_t peer)
{
	const struct session *p = peers_find(s, peer);
	return p ? client_uploading(p) : 0;
}

void peers_init(struct peers *s)
{
	uv_idle_init(s->jobs->loop, &s->looks);
	s->looks.data = s;
	s->receiving.limit = s->jobs->config.receive_bytes;
	s->sending.limit = s->jobs->config.send_bytes;
	s->jobs->peers = (struct peer_calls){.user = s,
					     .name = name,
					     .send_lease = worker_send_lease,
					     .revoke = worker_send_revoke,
					     .acknowledge = worker_send_ack,
					     .fault = fault,
					     .dismiss = dismiss_peer,
					     .extended = extended,
					     .job_ended = job_ended,
					     .jobs_let_go = jobs_let_go,
					     .films_free = fetch_previews,
					     .file_read = file_read,
					     .jobs_read = conversations_go_on,
					     .uses_result = fetch_uses,
					     .uploading = uploading};
}
