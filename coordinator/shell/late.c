/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/shell/late.h"

#include "common/base/mem.h"
#include "coordinator/shell/digest.h"
#include "coordinator/shell/incoming.h"
#include "coordinator/shell/replay.h"
#include "coordinator/shell/jobs.h"

#include <stdlib.h>
#include <string.h>

int late_add(struct live_job *o, const struct lease_key *k, uint64_t at, struct error *e)
{
	if (o->late_count == o->late_capacity) {
		size_t want = o->late_capacity ? 2 * o->late_capacity : 64;
		struct late_result *more = mem_grow(o->late, o->late_capacity * sizeof *more, want * sizeof *more);
		if (!more)
			return error_set(e, ENOMEM, "no memory for results that wait");
		o->late = more;
		o->late_capacity = want;
	}
	o->late[o->late_count++] = (struct late_result){.key = *k, .at = at};
	return 0;
}

static void drop(struct live_job *o, size_t i)
{
	memmove(&o->late[i], &o->late[i + 1], (--o->late_count - i) * sizeof *o->late);
}

void late_forget(struct live_job *o, const struct lease_key *k)
{
	for (size_t i = o->late_count; i-- > 0;) {
		const struct lease_key *l = &o->late[i].key;
		if (l->kind == k->kind && l->group == k->group && l->part == k->part && l->epoch >= k->epoch)
			drop(o, i);
	}
}

static int by_time(const void *a, const void *b)
{
	const struct late_result *x = a, *y = b;
	if (x->key.kind != y->key.kind)
		return x->key.kind == LEASE_BOOTSTRAP ? -1 : 1;
	if (x->key.epoch != y->key.epoch)
		return x->key.epoch < y->key.epoch ? -1 : 1;
	return (x->at > y->at) - (x->at < y->at);
}

void late_sort(struct live_job *o)
{
	if (o->late_count)
		qsort(o->late, o->late_count, sizeof *o->late, by_time);
}

bool late_withholds(struct live_job *o, const struct lease_key *k, uint64_t peer)
{
	for (size_t i = 0; i < o->late_count; i++)
		if (lease_key_equal(&o->late[i].key, k)) {
			o->late[i].peer = peer;
			return true;
		}
	return false;
}

/* It is damaged by now, too: its lease is open. */
static void give_up(struct jobs *s, struct live_job *o, const struct late_result *l, const char *why)
{
	struct event ev = {.kind = EVENT_LEASE_RETURNED, .peer = l->peer, .job = o->id, .lease = {.key = l->key}};
	live_job_log(o, LOG_SPOOL_FAULT, "text=%s", log_quote(why).text);
	if (l->peer)
		jobs_step(s, &ev);
}

/* To the core, which says whether it counts. */
static int offer(struct jobs *s, const struct live_job *o, const struct late_result *l, struct error *e)
{
	struct event ev = {.kind = EVENT_STORED, .job = o->id, .lease = {.key = l->key, .valid = true}};
	struct envelope env;
	struct batch batch = {0};
	struct buf copy = {0};
	unsigned char *body;
	const unsigned char *payload;
	size_t size, payload_size;
	int rc = journal_body(o->journal, l->at, &body, &size, e);
	if (rc)
		return rc;
	rc = replay_unpack(&env, FARM__ENVELOPE__BODY_LEASE_RESULT, body, size, &payload, &payload_size, e);
	if (rc) {
		mem_free(body);
		return rc;
	}
	rc = batch_unpack(&batch, &o->plan, env.message->lease_result, payload, payload_size, e);
	if (!rc && farm_verifies(s->farm, &l->key))
		rc = digest_batch(&batch, &ev.lease.digest, e);
	copy.limit = payload_size;
	if (!rc && !buf_append(&copy, payload, payload_size))
		rc = error_set(e, ENOMEM, "no memory for a result");
	if (!rc) {
		const struct incoming in = {.batch = &batch,
					    .result = env.message->lease_result,
					    .payload = &copy,
					    .stored = true,
					    .stored_at = l->at};
		jobs_step_with(s, &ev, &in);
	}
	buf_fini(&copy);
	batch_fini(&batch);
	envelope_fini(&env);
	mem_free(body);
	return rc;
}

void late_drop(struct jobs *s, struct live_job *o)
{
	while (o->late_count) {
		struct late_result l = o->late[--o->late_count];
		give_up(s, o, &l, "a result that waited in the journal is computed again");
	}
}

/* true: one more counts, and others may now. */
static bool feed_one(struct jobs *s, struct live_job *o)
{
	for (size_t i = 0; i < o->late_count; i++) {
		struct late_result l = o->late[i];
		struct error e;
		enum replay_place place = replay_place(o, &l.key);
		if (place == REPLAY_LATE)
			continue;
		int rc = place == REPLAY_FITS ? offer(s, o, &l, &e) : 0;
		if (rc == -ENOMEM) /* later */
			return false;
		if (!rc && replay_place(o, &l.key) !=
				   REPLAY_MERGED) /* the core waits for something: an estimate of the error */
			continue;
		l = o->late[i];
		drop(o, i);
		if (rc)
			give_up(s, o, &l, e.text);
		return true;
	}
	return false;
}

void late_feed(struct jobs *s)
{
	if (s->feeding || s->stepping || s->stopping)
		return;
	s->feeding = true;
	for (struct live_job *o = s->orders; o;) {
		bool fed = o->late_count && !o->busy && !o->ended && feed_one(s, o);
		o = fed ? s->orders : o->next; /* the list may have changed */
	}
	s->feeding = false;
}
