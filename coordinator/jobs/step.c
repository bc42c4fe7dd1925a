/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Passes an event through the core and carries out the core's actions.
 *
 * jobs_step gives the event to the core (core/farm.h), which changes its state and answers with a list of actions.
 * The table `follow_up` carries these out. Events that arise meanwhile are queued and handled before jobs_step
 * returns; then the table is told that the step is over. The timer `wake` sends the event that the core needs when
 * only time has passed.
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

void jobs_defer(struct jobs *jobs, const struct event *ev)
{
	struct deferred *d = mem_alloc(1, sizeof *d);
	if (!d) /* 300 bytes, without which nothing can continue */
		abort();
	d->event = *ev;
	text_copy(d->text, sizeof d->text, ev->text ? ev->text : "");
	d->event.text = d->text;
	STAILQ_INSERT_TAIL(&jobs->deferred, d, next);
}

void jobs_break(struct jobs *jobs, uint64_t job, const char *text)
{
	struct event ev = {.kind = EVENT_JOB_BROKEN, .job = job, .text = text};
	jobs_defer(jobs, &ev);
}

static void on_wake(uv_timer_t *t);

static const struct incoming nothing;

static void one_step(struct jobs *jobs, struct event *ev, const struct incoming *in)
{
	struct update u;
	ev->time = jobs_now(jobs);
	ev->unread = ev->time - jobs->read;
	if (ev->unread < jobs->config.heartbeat_seconds + 1e-3 * TICK_MS) /* too short a silence to blame anybody */
		ev->unread = 0;
	farm_step(jobs->farm, ev, &u);
	jobs->changes++;
	jobs->follow_up->carry_out(jobs, &u, in);
	if (isfinite(u.wake) && !jobs->stopping) {
		double ms = ceil(1000 * (u.wake - jobs_now(jobs)));
		uv_timer_start(&jobs->wake, on_wake, ms > 1 ? (uint64_t)ms : 1, 0);
	} else {
		uv_timer_stop(&jobs->wake);
	}
}

void jobs_step(struct jobs *jobs, struct event *ev)
{
	if (jobs->stepping) /* messages of sessions may arrive while an update is being carried out */
		jobs_defer(jobs, ev);
	else
		jobs_step_with(jobs, ev, &nothing);
}

void jobs_step_with(struct jobs *jobs, struct event *ev, const struct incoming *in)
{
	assert(!jobs->stepping);
	jobs->stepping = true;
	one_step(jobs, ev, in);
	for (struct deferred *d; (d = STAILQ_FIRST(&jobs->deferred));) {
		STAILQ_REMOVE_HEAD(&jobs->deferred, next);
		one_step(jobs, &d->event, &nothing);
		mem_free(d);
	}
	jobs->stepping = false;
	jobs->follow_up->stepped(jobs);
}

int jobs_ask(struct jobs *jobs, struct event *ev, struct incoming *in, struct error *e)
{
	*e = (struct error){""};
	in->refusal = e;
	jobs_step_with(jobs, ev, in);
	return *e->text ? -EPERM : 0;
}

static void on_wake(uv_timer_t *t)
{
	struct event ev = {.kind = EVENT_TICK};
	jobs_step(t->data, &ev);
}

void jobs_films_free(struct jobs *jobs)
{
	jobs->follow_up->films_free(jobs);
}
