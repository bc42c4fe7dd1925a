/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/request_queue.h"

#include "common/base/mem.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/peers/upload.h"

#include <string.h>

/* Limits on the memory of waiting requests, in total and per peer. A worker asks once for each job that it knows, and
 * reports lost leases. */
enum { QUEUED_BYTES_MAX = 1 << 28, PEER_QUEUED_BYTES_MAX = 1 << 23 };

struct queued_request {
	STAILQ_ENTRY(queued_request) next;
	struct envelope envelope;
};

static size_t request_cost(const struct envelope *env)
{
	return env->bytes + sizeof(struct queued_request);
}

/* first: no request of this peer is waiting. */
static bool bypasses_queue(Farm__Envelope__BodyCase what, bool first)
{
	return what == FARM__ENVELOPE__BODY_HEARTBEAT || what == FARM__ENVELOPE__BODY_BYE ||
	       (first && what == FARM__ENVELOPE__BODY_JOB_LIST);
}

/* Whether this is a client's request that takes turns with others: an order is flushed on the loop's thread, and
 * listing hundreds of jobs takes milliseconds. Chunks of blobs are excluded, since a client sends them only after it
 * has got an answer. */
static bool must_take_turn(const struct session *p, Farm__Envelope__BodyCase what)
{
	return p->state == SESSION_CLIENT && what != FARM__ENVELOPE__BODY_BLOB_CHUNK && !bypasses_queue(what, false);
}

static bool must_wait(const struct session *p, Farm__Envelope__BodyCase what)
{
	bool first = STAILQ_EMPTY(&p->queued_requests);
	if (recovery_is_running(p->jobs))
		return !bypasses_queue(what, first);
	return must_take_turn(p, what) && (!first || p->peers->request_ms_this_tick > REQUESTS_MS_PER_TICK);
}

void request_queue_note_handled(struct session *p, Farm__Envelope__BodyCase what, double begun)
{
	if (!must_take_turn(p, what))
		return;
	p->peers->request_ms_this_tick += 1000 * (jobs_now(p->jobs) - begun);
	p->turn_number = ++p->peers->last_turn_number;
}

struct session *request_queue_next_session(const struct peers *s)
{
	struct session *next = NULL;
	for (struct session *p = LIST_FIRST(&s->sessions); p && s->request_ms_this_tick <= REQUESTS_MS_PER_TICK;
	     p = LIST_NEXT(p, next))
		if (!STAILQ_EMPTY(&p->queued_requests) && (!next || p->turn_number < next->turn_number))
			next = p;
	return next;
}

bool request_queue_defer(struct session *p, struct envelope *env)
{
	struct peers *s = p->peers;
	if (!must_wait(p, env->message->body_case))
		return false;
	size_t cost = request_cost(env);
	struct queued_request *h = p->queued_request_bytes + cost <= PEER_QUEUED_BYTES_MAX &&
						   s->queued_request_bytes + cost <= QUEUED_BYTES_MAX
					   ? mem_alloc(1, sizeof *h)
					   : NULL;
	if (!h) {
		session_fault(p, "too many requests wait for the coordinator: try again later");
		return true;
	}
	if (STAILQ_EMPTY(&p->queued_requests))
		p->waiting_heartbeat_at = jobs_now(p->jobs);
	h->envelope = *env;
	memset(env, 0, sizeof *env);
	STAILQ_INSERT_TAIL(&p->queued_requests, h, next);
	p->queued_request_bytes += cost;
	s->queued_request_bytes += cost;
	return true;
}

void request_queue_tick(struct session *p)
{
	bool waits = !STAILQ_EMPTY(&p->queued_requests) ||
		     (p->upload && (upload_is_looking_up(p->upload) || p->upload->flush));
	if (!waits || p->state == SESSION_LEAVING ||
	    jobs_now(p->jobs) < p->waiting_heartbeat_at + p->jobs->config.heartbeat_seconds)
		return;
	p->waiting_heartbeat_at = jobs_now(p->jobs);
	conn_send(p->conn, ENVELOPE(HEARTBEAT, heartbeat), NULL, 0);
}

bool request_queue_pop(struct session *p, struct envelope *env)
{
	struct queued_request *h = STAILQ_FIRST(&p->queued_requests);
	if (!h)
		return false;
	STAILQ_REMOVE_HEAD(&p->queued_requests, next);
	p->queued_request_bytes -= request_cost(&h->envelope);
	p->peers->queued_request_bytes -= request_cost(&h->envelope);
	*env = h->envelope;
	mem_free(h);
	return true;
}

void request_queue_drop(struct session *p)
{
	for (struct envelope env; request_queue_pop(p, &env);)
		envelope_fini(&env);
}
