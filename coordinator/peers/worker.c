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

static void take_lease_failed(struct session *p, struct envelope *env)
{
	struct buf nothing = {0};
	results_take(p->jobs, p->id, env, &nothing);
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
	results_take(p->jobs, p->id, env, &payload);
	buf_fini(&payload);
}

/* Counts a part of a long message as a sign of life, and sends the worker a heartbeat: its own heartbeats, and with
 * them our answers, are queued behind that message. */
void worker_heard(void *session)
{
	struct session *p = session;
	struct event ev = {.kind = EVENT_HEARTBEAT, .peer = p->id};
	if (!p->joined || p->state != SESSION_WORKER ||
	    jobs_now(p->jobs) < p->heard + p->jobs->config.heartbeat_seconds)
		return;
	p->heard = jobs_now(p->jobs);
	conn_send(p->conn, ENVELOPE(HEARTBEAT, heartbeat), NULL, 0);
	jobs_step(p->jobs, &ev);
}

void worker_message(struct session *p, struct envelope *env)
{
	struct event ev = {.kind = EVENT_HEARTBEAT, .peer = p->id};
	const Farm__Envelope *m = env->message;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HEARTBEAT: /* answered, so that a worker notices a dead connection */
		conn_send(p->conn, m, NULL, 0);
		jobs_step(p->jobs, &ev);
		break;
	case FARM__ENVELOPE__BODY_LEASE_REQUEST:
		ev.kind = EVENT_REQUEST;
		ev.want = m->lease_request->want;
		jobs_step(p->jobs, &ev);
		break;
	case FARM__ENVELOPE__BODY_LEASE_RESULT:
		jobs_step(p->jobs, &ev);
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
		conn_close(p->conn, "the worker ended the connection");
		break;
	default:
		session_fault(p, "not a message for a worker to send");
	}
}
