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
#include "coordinator/peers/request_queue.h"
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
static bool close_oldest_unidentified(struct peers *s)
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

void peers_accept(struct peers *s, struct listener *source)
{
	struct conn_config config = {{SESSION_HELLO_HEADER_MAX, 0},
				     SESSION_HELLO_SEND_MAX,
				     s->jobs->config.stall_seconds,
				     s->jobs->config.hello_seconds,
				     s->tls,
				     &s->receive_pool,
				     &s->send_pool};
	struct error e;
	bool has_room = s->session_count < s->jobs->config.max_connections || close_oldest_unidentified(s);
	struct session *p = has_room ? mem_alloc(1, sizeof *p) : NULL;
	struct conn *c;
	source->is_accept_pending = false;
	if (!p) {
		log_event(LOG_PEER_REFUSED, "text=\"too many connections\"");
		if (conn_accept(&c, (uv_stream_t *)&source->tcp, &config, &refused_events, NULL, &e) == 0)
			conn_close(c, "too many connections");
		else
			source->is_accept_pending = true;
		return;
	}
	p->peers = s;
	p->jobs = s->jobs;
	p->id = ++s->last_peer_id;
	STAILQ_INIT(&p->requests);
	STAILQ_INIT(&p->queued_requests);
	if (conn_accept(&p->conn, (uv_stream_t *)&source->tcp, &config, &conversation_events, p, &e)) {
		log_event(LOG_PEER_REFUSED, "text=%s", log_quote(e.text).text);
		source->is_accept_pending = true;
		mem_free(p);
		return;
	}
	conn_peer_name(p->conn, p->address, sizeof p->address);
	peers_add_session(s, p);
	log_event(LOG_PEER_ACCEPT, "peer=%llu address=%s", (unsigned long long)p->id, p->address);
}

void peers_tick(struct peers *s)
{
	for (unsigned i = 0; i < s->listener_count; i++)
		if (s->listeners[i].is_accept_pending)
			peers_accept(s, &s->listeners[i]);
	conversations_tick(s);
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next)) {
		client_tick(p);
		request_queue_tick(p);
	}
}

void peers_stop(struct peers *s)
{
	for (unsigned i = 0; i < s->listener_count; i++)
		uv_close((uv_handle_t *)&s->listeners[i].tcp, NULL);
	uv_close((uv_handle_t *)&s->lookup_idle, NULL);
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		conn_close(p->conn, "the coordinator stops");
}

static const char *peer_name(struct peers *s, uint64_t peer)
{
	const struct session *p = peers_find_session(s, peer);
	return p ? p->name : NULL;
}

static void fault_peer(struct peers *s, uint64_t peer, const char *text)
{
	struct session *p = peers_find_session(s, peer);
	if (p)
		session_fault(p, "%s", text);
}

static void dismiss_peer(struct peers *s, uint64_t peer, const char *text)
{
	struct session *p = peers_find_session(s, peer);
	if (!p)
		return;
	p->is_known_to_core = false;
	session_fault(p, "%s", text);
}

static void answer_extension(struct peers *s, uint64_t peer, const char *refusal, const char *text)
{
	struct session *p = peers_find_session(s, peer);
	if (p)
		client_send_done(p, refusal, text);
}

static void announce_job_end(struct peers *s, uint64_t job)
{
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		if (p->state == SESSION_WORKER)
			worker_send_job_end(p, job);
}

static void release_watchers(struct peers *s)
{
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		if (p->watched_job && p->last_sent_status && !jobs_find_live(s->jobs, p->watched_job))
			client_tick(p);
}

static void announce_file_checked(struct peers *s, const struct blob_hash *h, int rc, const char *text)
{
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next)) {
		worker_requests_file_checked(p, h, rc ? text : "");
		client_file_checked(p, h, rc == 0);
	}
}

static uint64_t uploading_bytes(struct peers *s, uint64_t peer)
{
	const struct session *p = peers_find_session(s, peer);
	return p ? client_uploading_bytes(p) : 0;
}

void peers_init(struct peers *s)
{
	uv_idle_init(s->jobs->loop, &s->lookup_idle);
	s->lookup_idle.data = s;
	s->receive_pool.max_bytes = s->jobs->config.max_receive_bytes;
	s->send_pool.max_bytes = s->jobs->config.max_send_bytes;
	s->jobs->peers = (struct peer_calls){.user = s,
					     .peer_name = peer_name,
					     .send_lease = worker_send_lease,
					     .revoke_lease = worker_send_revoke,
					     .acknowledge_result = worker_send_ack,
					     .fault_peer = fault_peer,
					     .dismiss_peer = dismiss_peer,
					     .answer_extension = answer_extension,
					     .announce_job_end = announce_job_end,
					     .release_watchers = release_watchers,
					     .serve_previews = fetch_serve_previews,
					     .announce_file_checked = announce_file_checked,
					     .resume_requests = conversations_resume,
					     .is_result_in_use = fetch_uses_result,
					     .uploading_bytes = uploading_bytes};
}
