/* SPDX-License-Identifier: Apache-2.0 */
/* What people want of jobs that are there: that they wait, go on, come earlier or later, last longer. */
#include "coordinator/core/state.h"

#include <assert.h>
#include <string.h>

/* The live job that somebody means; NULL: the answer is given. */
static struct job *meant(struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->job);
	if (j && job_is_live(j))
		return j;
	if (ev->tag)
		rounds_reject(f, ev, j ? "the job is over" : "no such job");
	return NULL;
}

void orders_hold(struct farm *f, const struct event *ev)
{
	struct job *j = meant(f, ev);
	if (j)
		job_hold(j, ev->hold, ev->text ? ev->text : "", f->now);
}

void orders_priority(struct farm *f, const struct event *ev)
{
	struct job *j = meant(f, ev);
	if (!j)
		return;
	if (ev->priority < -PRIORITY_MAX || ev->priority > PRIORITY_MAX) {
		rounds_reject(f, ev, "a priority is from -100 to 100");
		return;
	}
	orders_delist(f, j);
	j->priority = ev->priority;
	orders_enlist(f, j);
}

void orders_extend(struct farm *f, const struct event *ev)
{
	struct job *j = meant(f, ev);
	if (!j)
		return;
	assert(ev->plan->rounds >= j->plan.rounds && ev->plan->groups == j->plan.groups &&
	       ev->plan->parts == j->plan.parts);
	j->plan.rounds = ev->plan->rounds;
	j->plan.seconds = ev->plan->seconds;
	j->plan.target_error = ev->plan->target_error;
	j->progress_floor = 0;
	if (j->looks.count)
		job_forecast(j);
	if (j->kind == LEASE_RENDER)
		job_raise_limit(j);
	/* While its error was estimated once more for a bound that is none any longer, it goes on. */
	if (j->ending != END_NONE)
		j->ending = rounds_bound(j, job_elapsed(j, f->now));
}

static bool comes_before(const struct job *a, const struct job *b)
{
	return a->priority > b->priority || (a->priority == b->priority && a->id < b->id);
}

void orders_enlist(struct farm *f, struct job *j)
{
	uint32_t i = f->live_count++;
	for (; i > 0 && comes_before(j, f->live[i - 1]); i--)
		f->live[i] = f->live[i - 1];
	f->live[i] = j;
}

void orders_delist(struct farm *f, const struct job *j)
{
	uint32_t i = 0;
	while (f->live[i] != j)
		i++;
	f->live_count--;
	memmove(&f->live[i], &f->live[i + 1], (f->live_count - i) * sizeof *f->live);
}
