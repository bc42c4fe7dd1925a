/* SPDX-License-Identifier: Apache-2.0 */
/* Passes events through the core and carries out the core's actions. The loop's thread. */
#ifndef COORDINATOR_JOBS_STEP_H
#define COORDINATOR_JOBS_STEP_H

#include "coordinator/live_job/jobs.h"

/* The functions that carry out the core's actions, as a table, because they make steps themselves (lifecycle.c). */
struct step_handlers {
	/* Carries out the actions of an update, in order. in: data that came with the event. */
	void (*on_update)(struct jobs *jobs, const struct update *u, const struct incoming *in);
	void (*on_step_done)(struct jobs *jobs);  /* the event and all events deferred meanwhile have been handled */
	void (*on_films_free)(struct jobs *jobs); /* a live job is no longer busy */
};

/* Gives the event to the core, and carries out its actions and everything that follows from them. */
void jobs_step(struct jobs *jobs, struct event *ev);
/* Like jobs_step(), for an event with more data (incoming.h). Not while an update is being carried out. */
void jobs_step_with_data(struct jobs *jobs, struct event *ev, const struct incoming *in);
/* Like jobs_step_with_data(), for an event that the core, or the disk, may refuse. Returns -EPERM with the reason if it
 * is refused. Sets in->refusal. */
int jobs_try_step(struct jobs *jobs, struct event *ev, struct incoming *in, struct error *e);
/* Handles the event after the current update. Copies the text. */
void jobs_defer_event(struct jobs *jobs, const struct event *ev);
void jobs_defer_failure(struct jobs *jobs, uint64_t job, const char *text); /* fails the job after the current update */

/* Call when a live job is no longer busy: what waited for its canvas continues. Live jobs that have ended are gone
 * afterwards. */
void jobs_notify_films_free(struct jobs *jobs);

#endif
