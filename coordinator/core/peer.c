/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/peer.h"

#include "coordinator/core/job.h"

#include <math.h>

enum { BACKOFF_DOUBLINGS_MAX = 6 };

void peer_set_state(struct farm *f, struct peer *p, enum peer_state s)
{
	if (p->state == PEER_ACTIVE && s != PEER_ACTIVE)
		p->class->active_peer_count--;
	if (p->state != PEER_ACTIVE && s == PEER_ACTIVE)
		p->class->active_peer_count++;
	p->state = s;
	peer_requeue(f, p);
}

void peer_note_contact(struct farm *f, struct peer *p)
{
	p->last_seen = f->now;
	p->identity->contact_count += p->state == PEER_SILENT;
	if (p->state == PEER_SILENT)
		peer_set_state(f, p, p->identity->is_quarantined ? PEER_QUARANTINED : PEER_ACTIVE);
}

bool peer_wants_lease(const struct peer *p)
{
	return p->state == PEER_ACTIVE && p->held_lease_count < p->wanted_lease_count &&
	       p->held_lease_count < p->identity->lease_window &&
	       p->held_lease_count + p->delivered_lease_count < p->lease_capacity;
}

void peer_requeue(struct farm *f, struct peer *p)
{
	if (!list_is_empty(&p->waiting_link)) {
		list_remove(&p->waiting_link);
		f->waiting_count--;
	}
	if (peer_wants_lease(p)) {
		list_append(&p->class->waiting_peers, &p->waiting_link);
		p->queue_position = f->next_queue_position++;
		f->waiting_count++;
	}
}

static struct backoff *find_backoff(const struct peer *p, uint64_t job)
{
	for (int i = 0; i < IDENTITY_BACKOFFS_MAX; i++)
		if (p->identity->backoffs[i].job == job)
			return &p->identity->backoffs[i];
	return NULL;
}

/* Returns a free entry, that of a job that is over, or the one whose pause ends first. */
static struct backoff *choose_backoff_entry(const struct farm *f, struct identity *identity)
{
	struct backoff *first = &identity->backoffs[0];
	for (int i = 0; i < IDENTITY_BACKOFFS_MAX; i++) {
		struct backoff *a = &identity->backoffs[i];
		const struct job *j = a->job ? farm_find_job(f, a->job) : NULL;
		if (!j || !job_is_live(j))
			return a;
		if (a->until < first->until)
			first = a;
	}
	return first;
}

static struct backoff *begin_backoff(const struct farm *f, struct peer *p, uint64_t job)
{
	struct backoff *a = choose_backoff_entry(f, p->identity);
	*a = (struct backoff){.job = job};
	return a;
}

static bool holds_leases(const struct peer *p)
{
	return p->held_lease_count + p->delivered_lease_count > 0;
}

static bool holds_lease_of_job(const struct peer *p, uint64_t job)
{
	for (uint32_t i = 0; i < p->lease_capacity; i++)
		if (p->leases[i].is_in_use && p->leases[i].job->id == job)
			return true;
	return false;
}

/* This is not a failure, so the pause does not grow. memory_full_until keeps other jobs away for as long: however many
 * wait, the worker is asked once per pause. */
void peer_note_memory_full(const struct farm *f, struct peer *p, uint64_t job)
{
	struct backoff *a = find_backoff(p, job);
	bool holds_any = holds_leases(p);
	p->identity->memory_full_until = f->now + f->config.initial_backoff;
	p->identity->had_leases_when_full = holds_any;
	if (a && a->until > f->now && !a->is_memory_full)
		return;
	a = a ? a : begin_backoff(f, p, job);
	a->is_worker_at_fault = a->is_memory_full = true;
	/* If it holds leases of this job, the job waits for its own scene to leave the memory. */
	a->had_leases = holds_any && !holds_lease_of_job(p, job);
	a->until = f->now + f->config.initial_backoff;
}

void peer_note_failure(const struct farm *f, struct peer *p, uint64_t job, bool worker_at_fault)
{
	struct backoff *a = find_backoff(p, job);
	p->failures++;
	if (a && a->until > f->now) {
		a->is_worker_at_fault = a->is_worker_at_fault && worker_at_fault;
		a->is_memory_full = false;
		return;
	}
	a = a ? a : begin_backoff(f, p, job);
	uint32_t doublings = a->failures < BACKOFF_DOUBLINGS_MAX ? a->failures : BACKOFF_DOUBLINGS_MAX;
	a->failures++;
	a->is_worker_at_fault = worker_at_fault;
	a->is_memory_full = false;
	a->until = f->now + ldexp(f->config.initial_backoff, (int)doublings);
}

/* The number of leases that a worker may hold grows with the results it returns, so that a worker that takes
 * everything and returns nothing blocks little. */
static void set_window(struct farm *f, struct peer *p, uint32_t window)
{
	/* An old connection of the same worker may still exist. */
	struct peer **peers = p->identity->reference_count > 1 ? f->peers : &p;
	uint32_t count = p->identity->reference_count > 1 ? f->peer_count : 1;
	p->identity->lease_window = window;
	for (uint32_t i = 0; i < count; i++)
		if (peers[i]->identity == p->identity &&
		    peer_wants_lease(peers[i]) == list_is_empty(&peers[i]->waiting_link))
			peer_requeue(f, peers[i]);
}

void peer_note_lateness(struct farm *f, struct peer *p)
{
	set_window(f, p, p->identity->lease_window > 1 ? p->identity->lease_window / 2 : 1);
}

void peer_note_success(struct farm *f, struct peer *p, uint64_t job)
{
	struct backoff *a = find_backoff(p, job);
	p->merged++;
	p->identity->consecutive_faults = 0;
	if (a)
		*a = (struct backoff){0};
	if (p->identity->lease_window < f->config.max_peer_leases)
		set_window(f, p, 2 * p->identity->lease_window);
}

double peer_backoff_end(const struct peer *p, uint64_t job)
{
	const struct backoff *a = find_backoff(p, job);
	return a ? a->until : -INFINITY;
}

double peer_pause_end(const struct peer *p, const struct job *j)
{
	const struct backoff *a = find_backoff(p, j->id);
	bool is_idle = !holds_leases(p), holds_job_lease = holds_lease_of_job(p, j->id);
	double until = a && !(a->is_memory_full && a->had_leases && (is_idle || holds_job_lease)) ? a->until
												  : -INFINITY,
	       memory_end = p->identity->memory_full_until;
	return memory_end > until && !(is_idle && p->identity->had_leases_when_full) && !holds_job_lease ? memory_end
													 : until;
}

bool peer_is_at_fault(const struct peer *p, uint64_t job)
{
	const struct backoff *a = find_backoff(p, job);
	return a && a->is_worker_at_fault;
}

bool peer_waits_for_memory(const struct peer *p, uint64_t job)
{
	const struct backoff *a = find_backoff(p, job);
	return a && a->is_memory_full;
}
