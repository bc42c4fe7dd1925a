/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Passes an event through the core and carries out the core's actions.
 *
 * jobs_step gives the event to the core (core/farm.h), which changes its state and answers with a list of actions.
 * The table `step_handlers` carries these out. Events that arise meanwhile are queued and handled before jobs_step
 * returns; then the table is told that the step is over. The timer `wake_timer` sends the event that the core needs
 * when only time has passed.
 *
 * A step does not fail. If there is no memory for a queued event (300 bytes), the process ends.
 */
#include "coordinator/jobs/step.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/live_job/incoming.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

void jobs_defer_event(struct jobs *jobs, const struct event *ev)
{
	struct deferred_event *d = mem_alloc(1, sizeof *d);
	if (!d) /* 300 bytes, without which nothing can continue */
		abort();
	d->event = *ev;
	text_copy(d->text, sizeof d->text, ev->text ? ev->text : "");
	d->event.text = d->text;
	STAILQ_INSERT_TAIL(&jobs->deferred_events, d, next);
}

void jobs_defer_failure(struct jobs *jobs, uint64_t job, const char *text)
{
	struct event ev = {.kind = EVENT_JOB_FAILED, .job = job, .text = text};
	jobs_defer_event(jobs, &ev);
}

static void on_wake(uv_timer_t *t);

static const struct incoming empty_incoming;

static void run_step(struct jobs *jobs, struct event *ev, const struct incoming *in)
{
	struct update u;
	ev->time = jobs_now(jobs);
	ev->unread_seconds = ev->time - jobs->messages_read_until;
	/* Too short a silence to blame anybody. */
	if (ev->unread_seconds < jobs->config.heartbeat_seconds + 1e-3 * TICK_MS)
		ev->unread_seconds = 0;
	farm_step(jobs->farm, ev, &u);
	jobs->change_count++;
	jobs->step_handlers->on_update(jobs, &u, in);
	if (isfinite(u.wake_time) && !jobs->is_stopping) {
		double ms = ceil(1000 * (u.wake_time - jobs_now(jobs)));
		uv_timer_start(&jobs->wake_timer, on_wake, ms > 1 ? (uint64_t)ms : 1, 0);
	} else {
		uv_timer_stop(&jobs->wake_timer);
	}
}

void jobs_step(struct jobs *jobs, struct event *ev)
{
	if (jobs->is_stepping) /* messages of sessions may arrive while an update is being carried out */
		jobs_defer_event(jobs, ev);
	else
		jobs_step_with_data(jobs, ev, &empty_incoming);
}

void jobs_step_with_data(struct jobs *jobs, struct event *ev, const struct incoming *in)
{
	assert(!jobs->is_stepping);
	jobs->is_stepping = true;
	run_step(jobs, ev, in);
	for (struct deferred_event *d; (d = STAILQ_FIRST(&jobs->deferred_events));) {
		STAILQ_REMOVE_HEAD(&jobs->deferred_events, next);
		run_step(jobs, &d->event, &empty_incoming);
		mem_free(d);
	}
	jobs->is_stepping = false;
	jobs->step_handlers->on_step_done(jobs);
}

int jobs_try_step(struct jobs *jobs, struct event *ev, struct incoming *in, struct error *e)
{
	*e = (struct error){""};
	in->refusal = e;
	jobs_step_with_data(jobs, ev, in);
	return *e->text ? -EPERM : 0;
}

static void on_wake(uv_timer_t *t)
{
	struct event ev = {.kind = EVENT_TICK};
	jobs_step(t->data, &ev);
}

void jobs_notify_films_free(struct jobs *jobs)
{
	jobs->step_handlers->on_films_free(jobs);
}
