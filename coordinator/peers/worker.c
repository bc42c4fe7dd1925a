/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A worker's side of a session: what it says, and what it is told.
 *
 * It asks for leases, sends results or failures, asks for jobs and pieces of their files, and sends heartbeats. Each
 * message becomes an event for the core; results and failures are looked at first (results.c). What a worker may send
 * is bounded by the largest result of the jobs that it knows, and what waits for it to read by the leases that it asked
 * for.
 *
 * A message that no worker sends is answered by Fault, and the connection ends. A lease that cannot be packed ends it,
 * too: the worker calls again.
 */
#include "coordinator/peers/worker.h"

#include "common/base/text.h"
#include "coordinator/jobs/results.h"
#include "coordinator/jobs/step.h"
#include "coordinator/peers/worker_requests.h"

#include <string.h>

/* ---- it speaks ---- */

void worker_allow_results(struct session *p, const struct live_job *o)
{
	uint32_t need = batch_payload_max(&o->plan);
	if (need > p->payload_limit) {
		p->payload_limit = need;
		conn_set_limits(p->conn, (struct frame_limits){SESSION_HEADER, need});
	}
}

/* One that makes an epoch be taken back must not come while others read the films. */
static void take_lease_failed(struct session *p, struct envelope *env)
{
	struct buf nothing = {0};
	if (env->message->lease_failed->bad_states)
		results_take(p->jobs, p->id, env, &nothing);
	else
		results_take_failure(p->jobs, p->id, env->message->lease_failed);
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

/* Also a message that takes long is a word from its worker, who must know for as long that we are here: its heartbeats,
 * and with them our answers, are behind that message. */
void worker_heard(struct session *p)
{
	struct event ev = {.kind = EVENT_HEARD, .peer = p->id};
	Farm__Heartbeat beat;
	Farm__Envelope m;
	if (!p->joined || p->state != SESSION_WORKER ||
	    jobs_now(p->jobs) < p->heard + p->jobs->config.heartbeat_seconds)
		return;
	p->heard = jobs_now(p->jobs);
	farm__heartbeat__init(&beat);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_HEARTBEAT;
	m.heartbeat = &beat;
	session_send(p, &m, NULL, 0);
	jobs_step(p->jobs, &ev);
}

void worker_message(struct session *p, struct envelope *env)
{
	struct event ev = {.kind = EVENT_HEARD, .peer = p->id};
	const Farm__Envelope *m = env->message;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HEARTBEAT: /* answered, so that a worker notices a connection that is dead */
		session_send(p, m, NULL, 0);
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
		conn_close(p->conn, "the worker said goodbye");
		break;
	default:
		session_fault(p, "not a message that a worker says");
	}
}

/* ---- it is spoken to ---- */

/* As many leases as it wants, of the size of the largest, may wait for it to read them. */
static void allow_lease(struct session *p, size_t size)
{
	struct peer_status s;
	if (!farm_peer(p->jobs->farm, p->id, &s) || s.want * size <= p->leases_most)
		return;
	p->leases_most = s.want * size;
	conn_set_send_limit(p->conn, SESSION_SEND + p->leases_most);
}

void worker_send_lease(struct session *p, const struct live_job *o, const struct lease_key *k, bool anew)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	worker_allow_results(p, o);
	if (live_job_pack_lease(o, k, anew, &frame, &size, &e)) {
		conn_close(p->conn, e.text);
		return;
	}
	allow_lease(p, size);
	conn_send_frame(p->conn, frame, size);
}

void worker_send_revoke(struct session *p, const struct lease_key *k)
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

void worker_send_ack(struct session *p, const struct lease_key *k, enum ack ack, const char *text)
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

void worker_send_job_end(struct session *p, uint64_t job)
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
