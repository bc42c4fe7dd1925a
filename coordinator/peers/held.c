/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/held.h"

#include "common/base/mem.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/peers/upload.h"

#include <string.h>

/* Limits on the memory of waiting requests, in total and per peer. A worker asks once for each job that it knows, and
 * reports lost leases. */
enum { HELD_MOST = 1 << 28, PEER_MOST = 1 << 23 };

struct held {
	STAILQ_ENTRY(held) next;
	struct envelope envelope;
};

static size_t cost_of(const struct envelope *env)
{
	return env->bytes + sizeof(struct held);
}

/* first: no request of this peer is waiting. */
static bool is_answered_at_once(Farm__Envelope__BodyCase what, bool first)
{
	return what == FARM__ENVELOPE__BODY_HEARTBEAT || what == FARM__ENVELOPE__BODY_BYE ||
	       (first && what == FARM__ENVELOPE__BODY_JOB_LIST);
}

/* Whether this is a client's request that takes turns with others: an order is flushed on the loop's thread, and
 * listing hundreds of jobs takes milliseconds. Chunks of blobs are excluded, since a client sends them only after it
 * has got an answer. */
static bool is_request(const struct session *p, Farm__Envelope__BodyCase what)
{
	return p->state == SESSION_CLIENT && what != FARM__ENVELOPE__BODY_BLOB_CHUNK &&
	       !is_answered_at_once(what, false);
}

static bool must_wait(const struct session *p, Farm__Envelope__BodyCase what)
{
	bool first = STAILQ_EMPTY(&p->held);
	if (recovery_is_on(p->jobs))
		return !is_answered_at_once(what, first);
	return is_request(p, what) && (!first || p->peers->request_ms > HELD_REQUESTS_MS);
}

void held_end(struct session *p, Farm__Envelope__BodyCase what, double begun)
{
	if (!is_request(p, what))
		return;
	p->peers->request_ms += 1000 * (jobs_now(p->jobs) - begun);
	p->turn = ++p->peers->requests;
}

struct session *held_turn(const struct peers *s)
{
	struct session *next = NULL;
	for (struct session *p = LIST_FIRST(&s->sessions); p && s->request_ms <= HELD_REQUESTS_MS;
	     p = LIST_NEXT(p, next))
		if (!STAILQ_EMPTY(&p->held) && (!next || p->turn < next->turn))
			next = p;
	return next;
}

bool held_take(struct session *p, struct envelope *env)
{
	struct peers *s = p->peers;
	if (!must_wait(p, env->message->body_case))
		return false;
	size_t cost = cost_of(env);
	struct held *h =
		p->held_bytes + cost <= PEER_MOST && s->held_bytes + cost <= HELD_MOST ? mem_alloc(1, sizeof *h) : NULL;
	if (!h) {
		session_fault(p, "too many requests wait for the coordinator: try again later");
		return true;
	}
	if (STAILQ_EMPTY(&p->held))
		p->told = jobs_now(p->jobs);
	h->envelope = *env;
	memset(env, 0, sizeof *env);
	STAILQ_INSERT_TAIL(&p->held, h, next);
	p->held_bytes += cost;
	s->held_bytes += cost;
	return true;
}

void held_tick(struct session *p)
{
	bool waits = !STAILQ_EMPTY(&p->held) || (p->upload && (upload_is_looking(p->upload) || p->upload->flush));
	if (!waits || p->state == SESSION_LEAVING || jobs_now(p->jobs) < p->told + p->jobs->config.heartbeat_seconds)
		return;
	p->told = jobs_now(p->jobs);
	conn_send(p->conn, ENVELOPE(HEARTBEAT, heartbeat), NULL, 0);
}

bool held_next(struct session *p, struct envelope *env)
{
	struct held *h = STAILQ_FIRST(&p->held);
	if (!h)
		return false;
	STAILQ_REMOVE_HEAD(&p->held, next);
	p->held_bytes -= cost_of(&h->envelope);
	p->peers->held_bytes -= cost_of(&h->envelope);
	*env = h->envelope;
	mem_free(h);
	return true;
}

void held_drop(struct session *p)
{
	for (struct envelope env; held_next(p, &env);)
		envelope_fini(&env);
}
