/* SPDX-License-Identifier: Apache-2.0 */
/* Passes an event through the core and carries out what follows. The loop's thread. */
#ifndef COORDINATOR_JOBS_STEP_H
#define COORDINATOR_JOBS_STEP_H

#include "coordinator/live_job/jobs.h"

/* Functions that carry out the core's answers. A table, because they make steps themselves (start.c). */
struct follow_up {
	/* Carries out the actions of an update, in order. in: what came with the event. */
	void (*carry_out)(struct jobs *jobs, const struct update *u, const struct incoming *in);
	void (*stepped)(struct jobs *jobs);    /* the event and all events deferred meanwhile are handled */
	void (*films_free)(struct jobs *jobs); /* some live job is no longer busy */
};

/* Gives the event to the core and carries out the update and everything that follows. */
void jobs_step(struct jobs *jobs, struct event *ev);
/* The same, for an event with more data (incoming.h). Not while an update is being carried out. */
void jobs_step_with(struct jobs *jobs, struct event *ev, const struct incoming *in);
/* The same, for one that the core, or the disk, may refuse: -EPERM, with its reason. in: its refusal is set here. */
int jobs_ask(struct jobs *jobs, struct event *ev, struct incoming *in, struct error *e);
/* Later, after the current update. Copies the text. */
void jobs_defer(struct jobs *jobs, const struct event *ev);
void jobs_break(struct jobs *jobs, uint64_t job, const char *text); /* the job fails */

/* Some live job is no longer busy: what waited for its canvas continues. Live jobs that have ended are gone
 * afterwards. */
void jobs_films_free(struct jobs *jobs);

#endif
