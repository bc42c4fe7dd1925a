/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/lease.h"

#include "coordinator/core/job.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/peer.h"
#include "coordinator/core/proof.h"

#include <assert.h>

struct lease_key lease_get_key(const struct lease *l)
{
	return slot_lease_key(l->job, l->slot);
}

struct lease *lease_find(const struct slot *s, const struct peer *p)
{
	for (struct lease *l = s->leases; l; l = l->next)
		if (l->peer == p)
			return l;
	return NULL;
}

/* Returns a free entry in the worker's table of leases. If there is none, drops the worker's oldest overdue lease;
 * that there is one follows from peer_wants_lease. */
static struct lease *allocate_lease(struct farm *f, struct peer *p)
{
	struct lease *oldest = NULL;
	for (uint32_t i = 0; i < p->lease_capacity; i++) {
		struct lease *l = &p->leases[i];
		if (!l->is_in_use)
			return l;
		if (l->is_overdue && (!oldest || l->sent_at < oldest->sent_at))
			oldest = l;
	}
	assert(oldest);
	lease_revoke(f, oldest);
	return oldest;
}

static void add_lease_action(struct farm *f, enum action_kind kind, const struct lease *l)
{
	struct action *a = update_add(f, kind);
	a->peer = l->peer->id;
	a->key = lease_get_key(l);
	a->job = a->key.job;
	a->starts_from_seeds = l->slot->doubt.starts_from_seeds;
}

void lease_send(struct farm *f, struct peer *p, struct job *j, struct slot *s)
{
	struct lease *l = lease_find(s, p);
	assert(peer_wants_lease(p) && (!l || l->is_overdue));
	if (!l) {
		l = allocate_lease(f, p);
		*l = (struct lease){.is_in_use = true, .peer = p, .job = j, .slot = s, .next = s->leases};
		s->leases = l;
	}
	l->is_overdue = l->is_delivered = false;
	l->sent_at = f->now;
	l->deadline = f->now + job_lease_timeout(&f->config, j, s);
	if (l->deadline < f->next_expiry_check_at)
		f->next_expiry_check_at = l->deadline;
	if (s->holder_count == 0)
		s->last_holder_sent_at = f->now;
	else
		j->counts.duplicates += s->holder_count >= proof_max_holders(j, s);
	s->holder_count++;
	j->outstanding_lease_count++;
	j->owner->outstanding_lease_count++;
	p->held_lease_count++;
	job_place_slot(j, s);
	peer_requeue(f, p);
	if (!j->is_mixed)
		job_pin(j, p->class);
	add_lease_action(f, ACTION_SEND_LEASE, l);
}

static void release_slot(struct farm *f, struct lease *l)
{
	struct slot *s = l->slot;
	s->holder_count--;
	l->job->outstanding_lease_count--;
	l->job->owner->outstanding_lease_count--;
	if (l->is_delivered)
		l->peer->delivered_lease_count--;
	else
		l->peer->held_lease_count--;
	for (const struct lease *k = s->leases; k; k = k->next)
		if (k != l && !k->is_overdue)
			s->last_holder_sent_at = k->sent_at;
	job_place_slot(l->job, s);
	job_unpin_if_untouched(l->job);
	if (!peer_wants_lease(l->peer) || list_is_empty(&l->peer->waiting_link))
		peer_requeue(f, l->peer);
}

void lease_mark_delivered(struct farm *f, struct lease *l)
{
	struct peer *p = l->peer;
	if (l->is_delivered)
		return;
	l->is_delivered = true;
	if (l->is_overdue)
		return;
	p->held_lease_count--;
	p->delivered_lease_count++;
	if (list_is_empty(&p->waiting_link))
		peer_requeue(f, p);
}

void lease_drop(struct farm *f, struct lease *l)
{
	struct lease **at = &l->slot->leases;
	while (*at != l)
		at = &(*at)->next;
	*at = l->next;
	if (!l->is_overdue)
		release_slot(f, l);
	l->is_in_use = false;
}

void lease_revoke(struct farm *f, struct lease *l)
{
	add_lease_action(f, ACTION_REVOKE_LEASE, l);
	lease_drop(f, l);
}

void lease_expire(struct farm *f, struct lease *l)
{
	l->is_overdue = true;
	l->slot->timeout_count++;
	l->job->counts.timeouts++;
	release_slot(f, l);
	peer_note_lateness(f, l->peer);
}

void lease_revoke_slot(struct farm *f, struct slot *s)
{
	while (s->leases)
		lease_revoke(f, s->leases);
}
