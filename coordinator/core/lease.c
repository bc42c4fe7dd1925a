/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/lease.h"

#include "coordinator/core/job.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/peer.h"
#include "coordinator/core/proof.h"

#include <assert.h>

struct lease_key lease_key(const struct lease *l)
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
		if (!l->in_use)
			return l;
		if (l->overdue && (!oldest || l->sent_at < oldest->sent_at))
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
	a->key = lease_key(l);
	a->job = a->key.job;
	a->from_seeds = l->slot->doubt.from_seeds;
}

void lease_send(struct farm *f, struct peer *p, struct job *j, struct slot *s)
{
	struct lease *l = lease_find(s, p);
	assert(peer_wants_lease(p) && (!l || l->overdue));
	if (!l) {
		l = allocate_lease(f, p);
		*l = (struct lease){.in_use = true, .peer = p, .job = j, .slot = s, .next = s->leases};
		s->leases = l;
	}
	l->overdue = l->delivered = false;
	l->sent_at = f->now;
	l->deadline = f->now + job_lease_timeout(&f->config, j, s);
	if (l->deadline < f->expiry_check_at)
		f->expiry_check_at = l->deadline;
	if (s->holder_count == 0)
		s->holder_since = f->now;
	else
		j->counts.duplicates += s->holder_count >= proof_max_holders(j, s);
	s->holder_count++;
	j->outstanding_leases++;
	j->owner->outstanding_leases++;
	p->held_leases++;
	job_place_slot(j, s);
	peer_requeue(f, p);
	if (!j->mixed)
		job_pin(j, p->class);
	add_lease_action(f, ACTION_SEND_LEASE, l);
}

static void release_slot(struct farm *f, struct lease *l)
{
	struct slot *s = l->slot;
	s->holder_count--;
	l->job->outstanding_leases--;
	l->job->owner->outstanding_leases--;
	if (l->delivered)
		l->peer->delivered_leases--;
	else
		l->peer->held_leases--;
	for (const struct lease *k = s->leases; k; k = k->next)
		if (k != l && !k->overdue)
			s->holder_since = k->sent_at;
	job_place_slot(l->job, s);
	job_unpin_if_untouched(l->job);
	if (!peer_wants_lease(l->peer) || list_is_empty(&l->peer->waiting_link))
		peer_requeue(f, l->peer);
}

void lease_mark_delivered(struct farm *f, struct lease *l)
{
	struct peer *p = l->peer;
	if (l->delivered)
		return;
	l->delivered = true;
	if (l->overdue)
		return;
	p->held_leases--;
	p->delivered_leases++;
	if (list_is_empty(&p->waiting_link))
		peer_requeue(f, p);
}

void lease_drop(struct farm *f, struct lease *l)
{
	struct lease **at = &l->slot->leases;
	while (*at != l)
		at = &(*at)->next;
	*at = l->next;
	if (!l->overdue)
		release_slot(f, l);
	l->in_use = false;
}

void lease_revoke(struct farm *f, struct lease *l)
{
	add_lease_action(f, ACTION_REVOKE, l);
	lease_drop(f, l);
}

void lease_expire(struct farm *f, struct lease *l)
{
	l->overdue = true;
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
