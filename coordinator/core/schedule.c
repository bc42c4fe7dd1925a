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
 * answer a lease (proof_bars_worker, doubt_bars_worker), or hold it already are passed over. While the usual duration
 * of a job's leases is not known, give_up_copies expires the older of two copies after a fixed time. schedule_at_latest
 * keeps the earliest time at which any of this may change.
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

static void schedule_at_latest(struct farm *f, double due_time)
{
	if (due_time < f->next_schedule_at)
		f->next_schedule_at = due_time;
}

/* Returns the worker of the class that has waited longest and does not hold the slot's lease. If there is none and
 * `allow_overdue` is set, returns one whose lease of the slot is overdue. */
static struct peer *find_waiting_in_class(struct farm *f, const struct peer_class *c, const struct job *j,
					  const struct slot *s, bool allow_overdue)
{
	struct peer *overdue_holder = NULL;
	for (struct link *k = c->waiting_peers.next; k != &c->waiting_peers; k = k->next) {
		struct peer *p = list_entry(k, struct peer, waiting_link);
		if (proof_bars_worker(j, s, p) || doubt_bars_worker(f, j, s, p))
			continue;
		double until = peer_pause_end(p, j);
		if (until > f->now) {
			schedule_at_latest(f, until);
			continue;
		}
		const struct lease *l = lease_find(s, p);
		if (!l)
			return p;
		if (allow_overdue && l->is_overdue && !overdue_holder)
			overdue_holder = p;
	}
	return overdue_holder;
}

static struct peer *find_waiting_peer(struct farm *f, const struct job *j, const struct slot *s, bool allow_overdue)
{
	if (j->class && !j->is_mixed)
		return find_waiting_in_class(f, j->class, j, s, allow_overdue);
	struct peer *first = NULL;
	for (struct link *k = f->classes.next; k != &f->classes; k = k->next) {
		const struct peer_class *c = list_entry(k, struct peer_class, link);
		struct peer *p =
			verify_class_can_begin(f, j, c) ? find_waiting_in_class(f, c, j, s, allow_overdue) : NULL;
		if (p && (!first || p->queue_position < first->queue_position))
			first = p;
	}
	return first;
}

/* Chooses a worker and a slot for the job's next lease. Slots that wait for a second worker go first, because their
 * chains and their round are blocked. */
static struct peer *choose_peer(struct farm *f, const struct job *j, struct slot **slot)
{
	for (int i = 0; i < 2; i++) {
		for (struct link *k = j->awaiting_second_answer[i].next; k != &j->awaiting_second_answer[i];
		     k = k->next) {
			*slot = list_entry(k, struct slot, link);
			struct peer *p = find_waiting_peer(f, j, *slot, true);
			if (p)
				return p;
		}
		if (list_is_empty(&j->ready_slots[i]))
			continue;
		*slot = list_entry(j->ready_slots[i].next, struct slot, link);
		struct peer *p = find_waiting_peer(f, j, *slot, true);
		if (p)
			return p;
	}
	return NULL;
}

static void hand_out_lease(struct farm *f, struct peer *p, struct job *j, struct slot *s)
{
	rounds_start_job(f, j);
	lease_send(f, p, j, s);
}

/* Whether a, the older of two jobs of the same priority, goes before b. */
static bool precedes(const struct job *a, const struct job *b)
{
	if (a->owner != b->owner && a->owner->outstanding_lease_count != b->owner->outstanding_lease_count)
		return a->owner->outstanding_lease_count < b->owner->outstanding_lease_count;
	return a->owner == b->owner ? a->outstanding_lease_count <= b->outstanding_lease_count : true;
}

/* If a job of the owner crashed workers, all jobs of that owner without a result so far share one lease at a time. */
static bool must_wait_for_owner(struct farm *f, const struct job *j)
{
	bool waits = share_is_limited(f, j) && share_count_unanswered_leases(f, j->owner) > 0;
	if (waits)
		schedule_at_latest(f, j->owner->limited_until);
	return waits;
}

/* Hands out a lease of the job whose turn it is, among the jobs of the highest priority that can use a waiting
 * worker. Returns false if there is none. */
static bool hand_out_ready(struct farm *f)
{
	struct job *best = NULL;
	struct slot *slot = NULL;
	struct peer *peer = NULL;
	for (uint32_t i = 0; i < f->live_job_count; i++) {
		struct job *j = f->live_jobs[i];
		if (best && j->priority < best->priority)
			break;
		if (!job_is_schedulable(j) || (best && precedes(best, j)) || must_wait_for_owner(f, j))
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
		hand_out_lease(f, peer, best, slot);
	return best;
}

/* Hands out a second copy of a lease that holds up a round. Returns false if there is none, or no worker for it. */
static bool hand_out_copy(struct farm *f)
{
	for (uint32_t i = 0; i < f->live_job_count; i++) {
		struct job *j = f->live_jobs[i];
		if (!job_is_schedulable(j) || must_wait_for_owner(f, j))
			continue;
		for (struct link *k = j->leased_slots[0].next; k != &j->leased_slots[0]; k = k->next) {
			struct slot *s = list_entry(k, struct slot, link);
			double due_time = job_copy_due_time(&f->config, j, s);
			if (due_time > f->now) {
				schedule_at_latest(f, due_time);
				break;
			}
			struct peer *p = find_waiting_peer(f, j, s, false);
			if (p) {
				hand_out_lease(f, p, j, s);
				return true;
			}
		}
	}
	return false;
}

/* Returns the older of the slot's two open leases; NULL if fewer than two workers hold one, or if one has delivered
 * an answer that is not judged yet. */
static struct lease *find_older_copy(const struct slot *s)
{
	struct lease *older = NULL;
	for (struct lease *l = s->leases; l; l = l->next) {
		if (l->is_delivered)
			return NULL;
		if (!l->is_overdue && (!older || l->sent_at < older->sent_at))
			older = l;
	}
	return s->holder_count > 1 ? older : NULL;
}

/* For a job without a median: if two workers have held the same lease for long and another worker is idle, gives up
 * the older copy. Returns true if some lease has two holders. */
static bool give_up_copies(struct farm *f, struct job *j)
{
	bool has_copies = false;
	for (uint32_t i = 0; i < j->slot_count; i++) {
		struct slot *s = &j->slots[i];
		struct lease *l = s->next_epoch == j->rounds ? find_older_copy(s) : NULL;
		if (!l)
			continue;
		has_copies = true;
		if (job_copy_timeout(&f->config, s) + l->sent_at <= f->now && find_waiting_peer(f, j, s, false)) {
			lease_expire(f, l);
			while (f->waiting_count && hand_out_copy(f))
				;
		}
	}
	return has_copies;
}

/* Calls give_up_copies for all jobs without a median, at most once in PERIOD seconds. */
static void check_copies(struct farm *f)
{
	enum { PERIOD = 10 };
	bool has_copies = false;
	for (uint32_t i = 0; f->waiting_count && f->now >= f->next_copy_check_at && i < f->live_job_count; i++)
		if (job_is_schedulable(f->live_jobs[i]) && isnan(f->live_jobs[i]->median_duration))
			has_copies = give_up_copies(f, f->live_jobs[i]) || has_copies;
	if (has_copies)
		f->next_copy_check_at = f->now + PERIOD;
	if (f->waiting_count && f->next_copy_check_at > f->now)
		schedule_at_latest(f, f->next_copy_check_at);
}

void schedule_leases(struct farm *f)
{
	f->next_schedule_at = INFINITY;
	verify_unpin_stranded_jobs(f);
	while (f->waiting_count && hand_out_ready(f))
		;
	while (f->waiting_count && hand_out_copy(f))
		;
	check_copies(f);
}

static void expire_leases(struct farm *f, struct peer *p, double read_until)
{
	for (uint32_t i = 0; i < p->lease_capacity; i++) {
		struct lease *l = &p->leases[i];
		if (!l->is_in_use || l->is_overdue)
			continue;
		if (l->deadline <= read_until)
			lease_expire(f, l);
		else
			f->next_expiry_check_at = fmin(f->next_expiry_check_at, l->deadline);
	}
}

void schedule_expire(struct farm *f, double read_until)
{
	if (f->now < f->next_expiry_check_at)
		return;
	f->next_expiry_check_at = INFINITY;
	for (uint32_t i = f->peer_count; i-- > 0;) {
		struct peer *p = f->peers[i];
		if (p->last_seen + f->config.disconnect_timeout <= read_until) {
			struct action *a = update_add(f, ACTION_CLOSE_PEER);
			a->peer = p->id;
			a->text = "silent for too long";
			connection_lose(f, p);
			continue;
		}
		if (p->state != PEER_SILENT && p->last_seen + f->config.silence_timeout <= read_until) {
			peer_set_state(f, p, PEER_SILENT);
			connection_lose_leases(f, p);
		}
		double patience = p->state == PEER_SILENT ? f->config.disconnect_timeout : f->config.silence_timeout;
		f->next_expiry_check_at = fmin(f->next_expiry_check_at, p->last_seen + patience);
		expire_leases(f, p, read_until);
	}
	/* Each call scans all workers and leases: at most one a second. */
	f->next_expiry_check_at = fmax(f->next_expiry_check_at, f->now + 1);
}
