/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Decides which worker gets which lease, and which leases have been out for too long.
 *
 * Happy path: schedule runs after every event. While workers wait, hand_out_ready gives the next lease of the job
 * whose turn it is: the highest priority first, then the owner and the job with the fewest leases out. Once nothing
 * is ready, hand_out_copy gives second copies of slow leases. schedule_expire looks about once a second for leases
 * past their deadline and for silent workers.
 *
 * Failures: a silent worker first loses its leases, then its connection. Workers that pause with a job, must not
 * answer a lease (proof_bars, doubt_bars), or hold it already are passed over. While the usual duration of a job's
 * leases is not known, give_up_copies expires the older of two copies after a fixed time. call_again keeps the
 * earliest time at which any of this may change.
 */
#include "coordinator/core/schedule.h"

#include "coordinator/core/connection.h"
#include "coordinator/core/doubt.h"
#include "coordinator/core/job.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/rounds.h"
#include "coordinator/core/share.h"
#include "coordinator/core/verify.h"

#include <math.h>

static void call_again(struct farm *f, double at)
{
	if (at < f->schedule_at)
		f->schedule_at = at;
}

/* Returns the worker of the class that has waited longest and does not hold the slot's lease. If there is none and
 * `again` is set, returns one whose lease of the slot is overdue. */
static struct peer *waiting_in(struct farm *f, const struct peer_class *c, const struct job *j, const struct slot *s,
			       bool again)
{
	struct peer *second = NULL;
	for (struct link *k = c->waiting.next; k != &c->waiting; k = k->next) {
		struct peer *p = list_entry(k, struct peer, waiting);
		if (proof_bars(j, s, p) || doubt_bars(f, j, s, p))
			continue;
		double until = peer_pauses_until(p, j);
		if (until > f->now) {
			call_again(f, until);
			continue;
		}
		const struct lease *l = lease_of(s, p);
		if (!l)
			return p;
		if (again && l->overdue && !second)
			second = p;
	}
	return second;
}

static struct peer *waiting_for(struct farm *f, const struct job *j, const struct slot *s, bool again)
{
	if (j->class && !j->mixed)
		return waiting_in(f, j->class, j, s, again);
	struct peer *first = NULL;
	for (struct link *k = f->classes.next; k != &f->classes; k = k->next) {
		const struct peer_class *c = list_entry(k, struct peer_class, link);
		struct peer *p = verify_may_begin(f, j, c) ? waiting_in(f, c, j, s, again) : NULL;
		if (p && (!first || p->queued < first->queued))
			first = p;
	}
	return first;
}

/* Chooses a worker and a slot for the job's next lease. Slots that wait for a second worker go first, because their
 * chains and their round are blocked. */
static struct peer *choose_peer(struct farm *f, const struct job *j, struct slot **slot)
{
	for (int i = 0; i < 2; i++) {
		for (struct link *k = j->second[i].next; k != &j->second[i]; k = k->next) {
			*slot = list_entry(k, struct slot, link);
			struct peer *p = waiting_for(f, j, *slot, true);
			if (p)
				return p;
		}
		if (list_is_empty(&j->ready[i]))
			continue;
		*slot = list_entry(j->ready[i].next, struct slot, link);
		struct peer *p = waiting_for(f, j, *slot, true);
		if (p)
			return p;
	}
	return NULL;
}

static void hand_out(struct farm *f, struct peer *p, struct job *j, struct slot *s)
{
	rounds_started(f, j);
	lease_send(f, p, j, s);
}

/* Whether a, the older of two jobs of the same priority, goes before b. */
static bool comes_first(const struct job *a, const struct job *b)
{
	if (a->owner != b->owner && a->owner->leases_out != b->owner->leases_out)
		return a->owner->leases_out < b->owner->leases_out;
	return a->owner == b->owner ? a->leases_out <= b->leases_out : true;
}

/* If a job of the owner crashed workers, all jobs of that owner without a result so far share one lease at a time. */
static bool must_wait(struct farm *f, const struct job *j)
{
	bool waits = share_is_limited(f, j) && share_unproven(f, j->owner) > 0;
	if (waits)
		call_again(f, j->owner->limited_until);
	return waits;
}

/* Hands out a lease of the job whose turn it is, among the jobs of the highest priority that can use a waiting
 * worker. Returns false if there is none. */
static bool hand_out_ready(struct farm *f)
{
	struct job *best = NULL;
	struct slot *slot = NULL;
	struct peer *peer = NULL;
	for (uint32_t i = 0; i < f->live_count; i++) {
		struct job *j = f->live[i];
		if (best && j->priority < best->priority)
			break;
		if (!job_is_open(j) || (best && comes_first(best, j)) || must_wait(f, j))
			continue;
		struct slot *s;
		struct peer *p = choose_peer(f, j, &s);
		if (p) {
			best = j;
			slot = s;
			peer = p;
		}
	}
	if (best)
		hand_out(f, peer, best, slot);
	return best;
}

/* Hands out a second copy of a lease that holds up a round. Returns false if there is none, or no worker for it. */
static bool hand_out_copy(struct farm *f)
{
	for (uint32_t i = 0; i < f->live_count; i++) {
		struct job *j = f->live[i];
		if (!job_is_open(j) || must_wait(f, j))
			continue;
		for (struct link *k = j->out[0].next; k != &j->out[0]; k = k->next) {
			struct slot *s = list_entry(k, struct slot, link);
			double at = job_straggles_at(&f->config, j, s);
			if (at > f->now) {
				call_again(f, at);
				break;
			}
			struct peer *p = waiting_for(f, j, s, false);
			if (p) {
				hand_out(f, p, j, s);
				return true;
			}
		}
	}
	return false;
}

/* Returns the older of the slot's two open leases; NULL if fewer than two workers hold one, or if one has delivered
 * an answer that is not judged yet. */
static struct lease *older_copy(const struct slot *s)
{
	struct lease *older = NULL;
	for (struct lease *l = s->leases; l; l = l->next) {
		if (l->delivered)
			return NULL;
		if (!l->overdue && (!older || l->sent < older->sent))
			older = l;
	}
	return s->holders > 1 ? older : NULL;
}

/* For a job without a median: if two workers have held the same lease for long and another worker is idle, gives up
 * the older copy. Returns true if some lease has two holders. */
static bool give_up_copies(struct farm *f, struct job *j)
{
	bool any = false;
	for (uint32_t i = 0; i < j->slot_count; i++) {
		struct slot *s = &j->slots[i];
		struct lease *l = s->next == j->rounds ? older_copy(s) : NULL;
		if (!l)
			continue;
		any = true;
		if (job_idle_timeout(&f->config, s) + l->sent <= f->now && waiting_for(f, j, s, false)) {
			lease_expire(f, l);
			while (f->waiting && hand_out_copy(f))
				;
		}
	}
	return any;
}

/* Calls give_up_copies for all jobs without a median, at most once in PERIOD seconds. */
static void look_at_copies(struct farm *f)
{
	enum { PERIOD = 10 };
	bool any = false;
	for (uint32_t i = 0; f->waiting && f->now >= f->idle_at && i < f->live_count; i++)
		if (job_is_open(f->live[i]) && isnan(f->live[i]->median))
			any = give_up_copies(f, f->live[i]) || any;
	if (any)
		f->idle_at = f->now + PERIOD;
	if (f->waiting && f->idle_at > f->now)
		call_again(f, f->idle_at);
}

void schedule(struct farm *f)
{
	f->schedule_at = INFINITY;
	verify_change_class(f);
	while (f->waiting && hand_out_ready(f))
		;
	while (f->waiting && hand_out_copy(f))
		;
	look_at_copies(f);
}

static void expire_leases(struct farm *f, struct peer *p, double read)
{
	for (uint32_t i = 0; i < p->lease_limit; i++) {
		struct lease *l = &p->leases[i];
		if (!l->used || l->overdue)
			continue;
		if (l->deadline <= read)
			lease_expire(f, l);
		else
			f->check_at = fmin(f->check_at, l->deadline);
	}
}

void schedule_expire(struct farm *f, double read)
{
	if (f->now < f->check_at)
		return;
	f->check_at = INFINITY;
	for (uint32_t i = f->peer_count; i-- > 0;) {
		struct peer *p = f->peers[i];
		if (p->last_seen + f->config.forget_after <= read) {
			struct action *a = update_add(f, ACTION_CLOSE_PEER);
			a->peer = p->id;
			a->text = "silent for too long";
			connection_lose(f, p);
			continue;
		}
		if (p->state != PEER_SILENT && p->last_seen + f->config.silent_after <= read) {
			peer_set_state(f, p, PEER_SILENT);
			connection_lose_leases(f, p);
		}
		double patience = p->state == PEER_SILENT ? f->config.forget_after : f->config.silent_after;
		f->check_at = fmin(f->check_at, p->last_seen + patience);
		expire_leases(f, p, read);
	}
	/* Each call scans all workers and leases: at most one a second. */
	f->check_at = fmax(f->check_at, f->now + 1);
}
