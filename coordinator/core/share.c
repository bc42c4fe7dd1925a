/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/share.h"

#include "common/base/text.h"
#include "coordinator/core/job.h"
#include "coordinator/core/owner.h"

#include <math.h>

bool share_competes(const struct job *a, const struct job *b)
{
	return !a->class || !b->class || a->mixed || b->mixed || a->class == b->class;
}

/* Returns how many machines all open leases of the job would keep busy if each machine takes `leases_each`. */
static double machines_wanted(const struct job *j, double leases_each)
{
	if (job_is_held(j))
		return 0;
	uint32_t open = j->rounds + 1 >= j->limit ? j->slot_count - j->done : j->slot_count;
	return open / leases_each;
}

static uint32_t machines_of(const struct farm *f, const struct job *j, double *leases_each)
{
	uint32_t machines = 0;
	double leases = 0;
	for (uint32_t i = 0; i < f->peer_count; i++) {
		const struct peer *p = f->peers[i];
		if (p->state != PEER_ACTIVE || !job_takes(j, p->class))
			continue;
		machines++;
		leases += p->want;
	}
	*leases_each = leases > 0 ? leases / machines : 1;
	return machines;
}

static bool is_first_lease(const struct lease *l)
{
	for (const struct lease *k = l->peer->leases; k < l; k++)
		if (k->used && !k->overdue && k->job == l->job)
			return false;
	return true;
}

static uint32_t workers_of(const struct job *j)
{
	uint32_t n = 0;
	for (uint32_t i = 0; i < j->slot_count; i++)
		for (const struct lease *l = j->slots[i].leases; l; l = l->next)
			n += !l->overdue && is_first_lease(l);
	return n;
}

/* Returns the i-th live job if it shares machines with j at the same priority, and belongs to o if o is not NULL;
 * otherwise NULL. */
static const struct job *competitor_at(const struct farm *f, uint32_t i, const struct job *j, const struct owner *o)
{
	const struct job *r = f->live[i];
	return r->priority == j->priority && share_competes(r, j) && (!o || r->owner == o) ? r : NULL;
}

/* Equal division of `there` machines among takers with different wants ("water filling"). level: what each taker gets
 * at most; taken: total of the wants below the level; above: number of wants above it. */
struct level {
	double there, taken, level;
	uint32_t above;
};

static void level_add(struct level *v, double want)
{
	if (want > v->level)
		v->above++;
	else
		v->taken += want;
}

/* Raises the level as far as the machines allow and starts a new count. Returns true when the level is final. */
static bool is_level(struct level *v)
{
	if (v->above == 0)
		return true;
	double next = (v->there - v->taken) / v->above;
	if (!(next > v->level))
		return true;
	*v = (struct level){.there = v->there, .level = next};
	return false;
}

static double machines_due(const struct farm *f, const struct job *j, uint32_t machines, double leases_each)
{
	struct level v = {.there = machines};
	for (struct link *k = f->owners.next; k != &f->owners; k = k->next)
		list_entry(k, struct owner, link)->wants = 0;
	for (uint32_t i = 0; i < f->live_count; i++) {
		const struct job *r = f->live[i];
		if (r->priority > j->priority && share_competes(r, j))
			v.there = fmax(0, v.there - machines_wanted(r, leases_each));
		else if (competitor_at(f, i, j, NULL))
			r->owner->wants += machines_wanted(r, leases_each);
	}
	do
		for (struct link *k = f->owners.next; k != &f->owners; k = k->next)
			level_add(&v, list_entry(k, struct owner, link)->wants);
	while (!is_level(&v));
	v = (struct level){.there = fmin(j->owner->wants, v.above ? v.level : INFINITY)};
	do
		for (uint32_t i = 0; i < f->live_count; i++)
			if (competitor_at(f, i, j, j->owner))
				level_add(&v, machines_wanted(f->live[i], leases_each));
	while (!is_level(&v));
	return fmin(machines_wanted(j, leases_each), v.above ? v.level : INFINITY);
}

/* Writes which other jobs go first (higher) or take turns with j, as in "; j4, j7 and 2 more come first". only: the
 * owner whose jobs may be named, NULL: all may; others are counted, as in "; 2 jobs of other owners come first". */
static void put_others(struct text *t, const struct farm *f, const struct job *j, const struct owner *only, bool higher,
		       double leases_each)
{
	enum { NAMED = 3 };
	const char *intro = higher ? "; " : "; by turns with ";
	uint64_t name[NAMED];
	uint32_t count = 0, named = 0;
	for (uint32_t i = 0; i < f->live_count; i++) {
		const struct job *r = f->live[i];
		if (r == j || !share_competes(r, j) || !(machines_wanted(r, leases_each) > 0) ||
		    !(higher ? r->priority > j->priority : r->priority == j->priority))
			continue;
		count++;
		if (named < NAMED && (!only || r->owner == only))
			name[named++] = r->id;
	}
	for (uint32_t i = 0; i < named; i++)
		text_put(t, "%sj%llu", i == 0 ? intro : i + 1 == count ? " and " : ", ", (unsigned long long)name[i]);
	if (count > named && named)
		text_put(t, " and %u more", count - named);
	else if (count && !named)
		text_put(t, "%s%u job%s of %s", intro, count, count == 1 ? "" : "s",
			 count == 1 ? "another owner" : "other owners");
	if (count && higher)
		text_put(t, count == 1 ? " comes first" : " come first");
}

static void put_place(const struct farm *f, const struct job *j, const struct owner *only, const struct share *s,
		      double leases_each, char *place, size_t size)
{
	struct text t = {place, size};
	text_put(&t, "%u of %u machine%s", s->workers, s->machines, s->machines == 1 ? "" : "s");
	put_others(&t, f, j, only, true, leases_each);
	put_others(&t, f, j, only, false, leases_each);
}

void share_of(const struct farm *f, const struct job *j, struct share *out)
{
	double leases_each;
	*out = (struct share){.machines_due = 0};
	if (!job_is_live(j))
		return;
	out->workers = workers_of(j);
	out->machines = machines_of(f, j, &leases_each);
	out->machines_due = machines_due(f, j, out->machines, leases_each);
	put_place(f, j, NULL, out, leases_each, out->place, sizeof out->place);
	put_place(f, j, j->owner, out, leases_each, out->owners_place, sizeof out->owners_place);
}

bool share_is_limited(const struct farm *f, const struct job *j)
{
	return j->owner->limited_until > f->now && !job_is_proven(j);
}

uint32_t share_unproven(const struct farm *f, const struct owner *o)
{
	uint32_t n = 0;
	for (uint32_t i = 0; i < f->live_count; i++)
		if (f->live[i]->owner == o && !job_is_proven(f->live[i]))
			n += f->live[i]->leases_out;
	return n;
}
