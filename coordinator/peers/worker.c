/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A worker's side of a session: its messages.
 *
 * A worker asks for leases, sends results or failures, asks for jobs and chunks of their files, and sends heartbeats.
 * Each message becomes an event for the core; results and failures are checked first (results.c). An invalid message
 * is answered by Fault, and the connection ends.
 */
#include "coordinator/peers/worker.h"

#include "coordinator/jobs/results.h"
#include "coordinator/jobs/step.h"
#include "coordinator/peers/worker_requests.h"

#include <string.h>

static void handle_lease_failed(struct session *p, struct envelope *env)
{
	struct buf nothing = {0};
	results_handle(p->jobs, p->id, env, &nothing);
}

static void handle_blob_get(struct session *p, const Farm__BlobGet *g)
{
	struct worker_request a = {.is_blob = true, .job_or_offset = g->offset};
	if (g->hash.len != BLOB_HASH_SIZE) {
		session_fault(p, "a blob's name has %zu bytes", g->hash.len);
		return;
	}
	memcpy(a.hash.bytes, g->hash.data, sizeof a.hash.bytes);
	worker_requests_handle(p, &a);
}

static void handle_lease_result(struct session *p, struct envelope *env)
{
	struct buf payload = conn_take_payload(p->conn);
	results_handle(p->jobs, p->id, env, &payload);
	buf_fini(&payload);
}

/* Counts a part of a long message as a sign of life, and sends the worker a heartbeat: its own heartbeats, and with
 * them our answers, are queued behind that message. */
void worker_note_partial(void *session)
{
	struct session *p = session;
	struct event ev = {.kind = EVENT_HEARTBEAT, .peer = p->id};
	if (!p->is_known_to_core || p->state != SESSION_WORKER ||
	    jobs_now(p->jobs) < p->partial_heartbeat_at + p->jobs->config.heartbeat_seconds)
		return;
	p->partial_heartbeat_at = jobs_now(p->jobs);
	conn_send(p->conn, ENVELOPE(HEARTBEAT, heartbeat), NULL, 0);
	jobs_step(p->jobs, &ev);
}

void worker_handle_message(struct session *p, struct envelope *env)
{
	struct event ev = {.kind = EVENT_HEARTBEAT, .peer = p->id};
	const Farm__Envelope *m = env->message;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HEARTBEAT: /* answered, so that a worker notices a dead connection */
		conn_send(p->conn, m, NULL, 0);
		jobs_step(p->jobs, &ev);
		break;
	case FARM__ENVELOPE__BODY_LEASE_REQUEST:
		ev.kind = EVENT_LEASE_REQUEST;
		ev.wanted_leases = m->lease_request->want;
		jobs_step(p->jobs, &ev);
		break;
	case FARM__ENVELOPE__BODY_LEASE_RESULT:
		jobs_step(p->jobs, &ev);
		if (p->is_known_to_core)
			handle_lease_result(p, env);
		break;
	case FARM__ENVELOPE__BODY_LEASE_FAILED:
		handle_lease_failed(p, env);
		break;
	case FARM__ENVELOPE__BODY_JOB_GET:
		worker_requests_handle(p, &(struct worker_request){.job_or_offset = m->job_get->job});
		break;
	case FARM__ENVELOPE__BODY_BLOB_GET:
		handle_blob_get(p, m->blob_get);
		break;
	case FARM__ENVELOPE__BODY_BYE:
		conn_close(p->conn, "the worker ended the connection");
		break;
	default:
		session_fault(p, "not a message for a worker to send");
	}
}
