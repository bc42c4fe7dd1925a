/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/peer.h"

#include "coordinator/core/job.h"

#include <math.h>

enum { PAUSE_DOUBLINGS = 6 };

void peer_set_state(struct farm *f, struct peer *p, enum peer_state s)
{
	if (p->state == PEER_ACTIVE && s != PEER_ACTIVE)
		p->class->active--;
	if (p->state != PEER_ACTIVE && s == PEER_ACTIVE)
		p->class->active++;
	p->state = s;
	peer_requeue(f, p);
}

void peer_heard(struct farm *f, struct peer *p)
{
	p->last_seen = f->now;
	p->who->calls += p->state == PEER_SILENT;
	if (p->state == PEER_SILENT)
		peer_set_state(f, p, p->who->quarantined ? PEER_QUARANTINED : PEER_ACTIVE);
}

bool peer_has_wish(const struct peer *p)
{
	return p->state == PEER_ACTIVE && p->held < p->want && p->held < p->who->window &&
	       p->held + p->delivered < p->lease_limit;
}

void peer_requeue(struct farm *f, struct peer *p)
{
	if (!list_is_empty(&p->waiting)) {
		list_remove(&p->waiting);
		f->waiting--;
	}
	if (peer_has_wish(p)) {
		list_append(&p->class->waiting, &p->waiting);
		p->queued = f->queued++;
		f->waiting++;
	}
}

static struct backoff *avoid_of(const struct peer *p, uint64_t job)
{
	for (int i = 0; i < IDENTITY_AVOIDED; i++)
		if (p->who->avoid[i].job == job)
			return &p->who->avoid[i];
	return NULL;
}

/* Returns a free entry, that of a job that is over, or the one whose pause ends first. */
static struct backoff *room_to_avoid(const struct farm *f, struct identity *who)
{
	struct backoff *first = &who->avoid[0];
	for (int i = 0; i < IDENTITY_AVOIDED; i++) {
		struct backoff *a = &who->avoid[i];
		const struct job *j = a->job ? farm_find_job(f, a->job) : NULL;
		if (!j || !job_is_live(j))
			return a;
		if (a->until < first->until)
			first = a;
	}
	return first;
}

static struct backoff *begin_to_avoid(const struct farm *f, struct peer *p, uint64_t job)
{
	struct backoff *a = room_to_avoid(f, p->who);
	*a = (struct backoff){.job = job};
	return a;
}

static bool is_holding(const struct peer *p)
{
	return p->held + p->delivered > 0;
}

static bool holds_lease_of(const struct peer *p, uint64_t job)
{
	for (uint32_t i = 0; i < p->lease_limit; i++)
		if (p->leases[i].used && p->leases[i].job->id == job)
			return true;
	return false;
}

/* This is not a failure, so the pause does not grow. full_until keeps other jobs away for as long: however many wait,
 * the worker is asked once per pause. */
void peer_has_no_room(const struct farm *f, struct peer *p, uint64_t job)
{
	struct backoff *a = avoid_of(p, job);
	bool held = is_holding(p);
	p->who->full_until = f->now + f->config.first_pause;
	p->who->full_held = held;
	if (a && a->until > f->now && !a->later)
		return;
	a = a ? a : begin_to_avoid(f, p, job);
	a->own = a->later = true;
	/* If it holds leases of this job, the job waits for its own scene to leave the memory. */
	a->held = held && !holds_lease_of(p, job);
	a->until = f->now + f->config.first_pause;
}

void peer_failed(const struct farm *f, struct peer *p, uint64_t job, bool own)
{
	struct backoff *a = avoid_of(p, job);
	p->failures++;
	if (a && a->until > f->now) {
		a->own = a->own && own;
		a->later = false;
		return;
	}
	a = a ? a : begin_to_avoid(f, p, job);
	uint32_t doublings = a->failures < PAUSE_DOUBLINGS ? a->failures : PAUSE_DOUBLINGS;
	a->failures++;
	a->own = own;
	a->later = false;
	a->until = f->now + ldexp(f->config.first_pause, (int)doublings);
}

/* The number of leases that a worker may hold grows with the results it returns, so that a worker that takes
 * everything and returns nothing blocks little. */
static void set_window(struct farm *f, struct peer *p, uint32_t window)
{
	struct peer **all = p->who->uses > 1 ? f->peers : &p; /* an old connection of the same worker may still exist */
	uint32_t count = p->who->uses > 1 ? f->peer_count : 1;
	p->who->window = window;
	for (uint32_t i = 0; i < count; i++)
		if (all[i]->who == p->who && peer_has_wish(all[i]) == list_is_empty(&all[i]->waiting))
			peer_requeue(f, all[i]);
}

void peer_was_late(struct farm *f, struct peer *p)
{
	set_window(f, p, p->who->window > 1 ? p->who->window / 2 : 1);
}

void peer_succeeded(struct farm *f, struct peer *p, uint64_t job)
{
	struct backoff *a = avoid_of(p, job);
	p->merged++;
	p->who->faults_in_row = 0;
	if (a)
		*a = (struct backoff){0};
	if (p->who->window < f->config.max_peer_leases)
		set_window(f, p, 2 * p->who->window);
}

double peer_avoids_until(const struct peer *p, uint64_t job)
{
	const struct backoff *a = avoid_of(p, job);
	return a ? a->until : -INFINITY;
}

double peer_pauses_until(const struct peer *p, const struct job *j)
{
	const struct backoff *a = avoid_of(p, j->id);
	bool free = !is_holding(p), in = holds_lease_of(p, j->id);
	double until = a && !(a->later && a->held && (free || in)) ? a->until : -INFINITY, full = p->who->full_until;
	return full > until && !(free && p->who->full_held) && !in ? full : until;
}

bool peer_lacks(const struct peer *p, uint64_t job)
{
	const struct backoff *a = avoid_of(p, job);
	return a && a->own;
}

bool peer_waits_for_room(const struct peer *p, uint64_t job)
{
	const struct backoff *a = avoid_of(p, job);
	return a && a->later;
}
