/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/lease.h"

#include "coordinator/core/job.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/peer.h"
#include "coordinator/core/proof.h"

#include <assert.h>

struct lease_key lease_key(const struct lease *l)
{
	return slot_key(l->job, l->slot);
}

struct lease *lease_of(const struct slot *s, const struct peer *p)
{
	for (struct lease *l = s->leases; l; l = l->next)
		if (l->peer == p)
			return l;
	return NULL;
}

/* Returns a free entry in the worker's table of leases. If there is none, drops the worker's oldest overdue lease;
 * that there is one follows from peer_has_wish. */
static struct lease *lease_take(struct farm *f, struct peer *p)
{
	struct lease *oldest = NULL;
	for (uint32_t i = 0; i < p->lease_limit; i++) {
		struct lease *l = &p->leases[i];
		if (!l->used)
			return l;
		if (l->overdue && (!oldest || l->sent < oldest->sent))
			oldest = l;
	}
	assert(oldest);
	lease_revoke(f, oldest);
	return oldest;
}

static void add_action(struct farm *f, enum action_kind kind, const struct lease *l)
{
	struct action *a = update_add(f, kind);
	a->peer = l->peer->id;
	a->key = lease_key(l);
	a->job = a->key.job;
	a->anew = l->slot->doubt.anew;
}

void lease_send(struct farm *f, struct peer *p, struct job *j, struct slot *s)
{
	struct lease *l = lease_of(s, p);
	assert(peer_has_wish(p) && (!l || l->overdue));
	if (!l) {
		l = lease_take(f, p);
		*l = (struct lease){.used = true, .peer = p, .job = j, .slot = s, .next = s->leases};
		s->leases = l;
	}
	l->overdue = l->delivered = false;
	l->sent = f->now;
	l->deadline = f->now + job_lease_timeout(&f->config, j, s);
	if (l->deadline < f->check_at)
		f->check_at = l->deadline;
	if (s->holders == 0)
		s->since = f->now;
	else
		j->counts.duplicates += s->holders >= proof_copies(j, s);
	s->holders++;
	j->leases_out++;
	j->owner->leases_out++;
	p->held++;
	job_place(j, s);
	peer_requeue(f, p);
	if (!j->mixed)
		job_pin(j, p->class);
	add_action(f, ACTION_SEND_LEASE, l);
}

static void let_go(struct farm *f, struct lease *l)
{
	struct slot *s = l->slot;
	s->holders--;
	l->job->leases_out--;
	l->job->owner->leases_out--;
	if (l->delivered)
		l->peer->delivered--;
	else
		l->peer->held--;
	for (const struct lease *k = s->leases; k; k = k->next)
		if (k != l && !k->overdue)
			s->since = k->sent;
	job_place(l->job, s);
	job_unpin_if_untouched(l->job);
	if (!peer_has_wish(l->peer) || list_is_empty(&l->peer->waiting))
		peer_requeue(f, l->peer);
}

void lease_deliver(struct farm *f, struct lease *l)
{
	struct peer *p = l->peer;
	if (l->delivered)
		return;
	l->delivered = true;
	if (l->overdue)
		return;
	p->held--;
	p->delivered++;
	if (list_is_empty(&p->waiting))
		peer_requeue(f, p);
}

void lease_drop(struct farm *f, struct lease *l)
{
	struct lease **at = &l->slot->leases;
	while (*at != l)
		at = &(*at)->next;
	*at = l->next;
	if (!l->overdue)
		let_go(f, l);
	l->used = false;
}

void lease_revoke(struct farm *f, struct lease *l)
{
	add_action(f, ACTION_REVOKE, l);
	lease_drop(f, l);
}

void lease_expire(struct farm *f, struct lease *l)
{
	l->overdue = true;
	l->slot->timeouts++;
	l->job->counts.timeouts++;
	let_go(f, l);
	peer_was_late(f, l->peer);
}

void lease_revoke_slot(struct farm *f, struct slot *s)
{
	while (s->leases)
		lease_revoke(f, s->leases);
}
