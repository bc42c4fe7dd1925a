/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/share.h"

#include "common/base/text.h"
#include "coordinator/core/job.h"
#include "coordinator/core/owner.h"

#include <math.h>

bool share_jobs_compete(const struct job *a, const struct job *b)
{
	return !a->class || !b->class || a->is_mixed || b->is_mixed || a->class == b->class;
}

/* Returns how many machines all open leases of the job would keep busy if each machine takes `leases_each`. */
static double wanted_machines(const struct job *j, double leases_each)
{
	if (job_is_held(j))
		return 0;
	uint32_t open = j->rounds + 1 >= j->round_limit ? j->slot_count - j->done_slot_count : j->slot_count;
	return open / leases_each;
}

static uint32_t count_machines(const struct farm *f, const struct job *j, double *leases_each)
{
	uint32_t machines = 0;
	double leases = 0;
	for (uint32_t i = 0; i < f->peer_count; i++) {
		const struct peer *p = f->peers[i];
		if (p->state != PEER_ACTIVE || !job_accepts_class(j, p->class))
			continue;
		machines++;
		leases += p->wanted_lease_count;
	}
	*leases_each = leases > 0 ? leases / machines : 1;
	return machines;
}

static bool is_first_lease(const struct lease *l)
{
	for (const struct lease *k = l->peer->leases; k < l; k++)
		if (k->is_in_use && !k->is_overdue && k->job == l->job)
			return false;
	return true;
}

static uint32_t count_workers(const struct job *j)
{
	uint32_t n = 0;
	for (uint32_t i = 0; i < j->slot_count; i++)
		for (const struct lease *l = j->slots[i].leases; l; l = l->next)
			n += !l->is_overdue && is_first_lease(l);
	return n;
}

/* Returns the i-th live job if it shares machines with j at the same priority, and belongs to o if o is not NULL;
 * otherwise NULL. */
static const struct job *competitor_at(const struct farm *f, uint32_t i, const struct job *j, const struct owner *o)
{
	const struct job *r = f->live_jobs[i];
	return r->priority == j->priority && share_jobs_compete(r, j) && (!o || r->owner == o) ? r : NULL;
}

/* Equal division of `machines` machines among takers with different wants ("water filling"). fair_level: what each
 * taker gets at most; allocated: total of the wants below the level; unsatisfied_count: number of wants above it. */
struct fair_level {
	double machines, allocated, level;
	uint32_t unsatisfied_count;
};

static void level_add(struct fair_level *v, double wanted)
{
	if (wanted > v->level)
		v->unsatisfied_count++;
	else
		v->allocated += wanted;
}

/* Raises the level as far as the machines allow and starts a new count. Returns true when the level is final. */
static bool raise_level(struct fair_level *v)
{
	if (v->unsatisfied_count == 0)
		return true;
	double next = (v->machines - v->allocated) / v->unsatisfied_count;
	if (!(next > v->level))
		return true;
	*v = (struct fair_level){.machines = v->machines, .level = next};
	return false;
}

static double machines_due(const struct farm *f, const struct job *j, uint32_t machines, double leases_each)
{
	struct fair_level v = {.machines = machines};
	for (struct link *k = f->owners.next; k != &f->owners; k = k->next)
		list_entry(k, struct owner, link)->wanted_machines = 0;
	for (uint32_t i = 0; i < f->live_job_count; i++) {
		const struct job *r = f->live_jobs[i];
		if (r->priority > j->priority && share_jobs_compete(r, j))
			v.machines = fmax(0, v.machines - wanted_machines(r, leases_each));
		else if (competitor_at(f, i, j, NULL))
			r->owner->wanted_machines += wanted_machines(r, leases_each);
	}
	do
		for (struct link *k = f->owners.next; k != &f->owners; k = k->next)
			level_add(&v, list_entry(k, struct owner, link)->wanted_machines);
	while (!raise_level(&v));
	v = (struct fair_level){.machines = fmin(j->owner->wanted_machines, v.unsatisfied_count ? v.level : INFINITY)};
	do
		for (uint32_t i = 0; i < f->live_job_count; i++)
			if (competitor_at(f, i, j, j->owner))
				level_add(&v, wanted_machines(f->live_jobs[i], leases_each));
	while (!raise_level(&v));
	return fmin(wanted_machines(j, leases_each), v.unsatisfied_count ? v.level : INFINITY);
}

/* Writes which other jobs go first (higher) or take turns with j, as in "; j4, j7 and 2 more come first".
 * visible_owner: the owner whose jobs may be named, NULL: all may; others are counted, as in "; 2 jobs of other owners
 * come first". */
static void put_competitors(struct text *t, const struct farm *f, const struct job *j,
			    const struct owner *visible_owner, bool higher, double leases_each)
{
	enum { NAMED_MAX = 3 };
	const char *intro = higher ? "; " : "; by turns with ";
	uint64_t named_ids[NAMED_MAX];
	uint32_t count = 0, named = 0;
	for (uint32_t i = 0; i < f->live_job_count; i++) {
		const struct job *r = f->live_jobs[i];
		if (r == j || !share_jobs_compete(r, j) || !(wanted_machines(r, leases_each) > 0) ||
		    !(higher ? r->priority > j->priority : r->priority == j->priority))
			continue;
		count++;
		if (named < NAMED_MAX && (!visible_owner || r->owner == visible_owner))
			named_ids[named++] = r->id;
	}
	for (uint32_t i = 0; i < named; i++)
		text_appendf(t, "%sj%llu",
			     i == 0	      ? intro
			     : i + 1 == count ? " and "
					      : ", ",
			     (unsigned long long)named_ids[i]);
	if (count > named && named)
		text_appendf(t, " and %u more", count - named);
	else if (count && !named)
		text_appendf(t, "%s%u job%s of %s", intro, count, count == 1 ? "" : "s",
			     count == 1 ? "another owner" : "other owners");
	if (count && higher)
		text_appendf(t, count == 1 ? " comes first" : " come first");
}

static void put_place(const struct farm *f, const struct job *j, const struct owner *visible_owner,
		      const struct share *s, double leases_each, char *place, size_t size)
{
	struct text t = {place, size};
	text_appendf(&t, "%u of %u machine%s", s->workers, s->machines, s->machines == 1 ? "" : "s");
	put_competitors(&t, f, j, visible_owner, true, leases_each);
	put_competitors(&t, f, j, visible_owner, false, leases_each);
}

void share_compute(const struct farm *f, const struct job *j, struct share *out)
{
	double leases_each;
	*out = (struct share){.machines_due = 0};
	if (!job_is_live(j))
		return;
	out->workers = count_workers(j);
	out->machines = count_machines(f, j, &leases_each);
	out->machines_due = machines_due(f, j, out->machines, leases_each);
	put_place(f, j, NULL, out, leases_each, out->place, sizeof out->place);
	put_place(f, j, j->owner, out, leases_each, out->owners_place, sizeof out->owners_place);
}

bool share_is_limited(const struct farm *f, const struct job *j)
{
	return j->owner->limited_until > f->now && !job_has_answers(j);
}

uint32_t share_count_unanswered_leases(const struct farm *f, const struct owner *o)
{
	uint32_t n = 0;
	for (uint32_t i = 0; i < f->live_job_count; i++)
		if (f->live_jobs[i]->owner == o && !job_has_answers(f->live_jobs[i]))
			n += f->live_jobs[i]->outstanding_lease_count;
	return n;
}
