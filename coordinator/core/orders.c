/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/orders.h"

#include "common/base/text.h"
#include "coordinator/core/forecast.h"
#include "coordinator/core/rounds.h"

#include <assert.h>
#include <math.h>

/* Returns the live job that the event names. Otherwise rejects the event, if it has a tag, and returns NULL. */
static struct job *find_live_job(struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->job);
	if (j && job_is_live(j))
		return j;
	if (ev->tag)
		rounds_reject_event(f, ev, j ? "the job is over" : "no such job");
	return NULL;
}

static void set_hold(struct job *j, enum job_hold hold, const char *reason, double now)
{
	bool was_held = job_is_held(j);
	text_copy(j->hold_reasons[hold], sizeof j->hold_reasons[hold], reason);
	if (hold == HOLD_FILES)
		j->files_changed_at = now;
	if (!was_held && job_is_held(j))
		j->held_since = now;
	if (!was_held || job_is_held(j))
		return;
	j->progress_floor = job_progress(j, now); /* must not go back when the job's clock moves on */
	double pause = now - j->held_since;	  /* shifts the job's times by the time it was held; NAN stays NAN */
	j->started_at += pause;
	j->first_round_at += pause;
	j->estimate_requested_at += pause;
	j->held_since = NAN;
}

void orders_hold(struct farm *f, const struct event *ev)
{
	struct job *j = find_live_job(f, ev);
	if (j)
		set_hold(j, ev->hold, ev->text ? ev->text : "", f->now);
}

void orders_set_priority(struct farm *f, const struct event *ev)
{
	struct job *j = find_live_job(f, ev);
	if (!j)
		return;
	if (ev->priority < -PRIORITY_MAX || ev->priority > PRIORITY_MAX) {
		rounds_reject_event(f, ev, "a priority is from -100 to 100");
		return;
	}
	rounds_remove_live(f, j);
	j->priority = ev->priority;
	rounds_insert_live(f, j);
}

void orders_extend(struct farm *f, const struct event *ev)
{
	struct job *j = find_live_job(f, ev);
	if (!j)
		return;
	assert(ev->plan->rounds >= j->plan.rounds && ev->plan->groups == j->plan.groups &&
	       ev->plan->parts == j->plan.parts);
	j->plan.rounds = ev->plan->rounds;
	j->plan.seconds = ev->plan->seconds;
	j->plan.target_error = ev->plan->target_error;
	j->progress_floor = 0;
	if (j->looks.count)
		job_update_forecast(j);
	if (j->kind == LEASE_RENDER)
		job_raise_round_limit(j);
	/* If an estimate of the error was due because of the old bounds, END_NONE here lets the job continue after
	 * it. */
	if (j->pending_end != END_NONE)
		j->pending_end = rounds_met_bound(j, job_elapsed(j, f->now));
}
