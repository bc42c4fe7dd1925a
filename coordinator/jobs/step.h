/* SPDX-License-Identifier: Apache-2.0 */
/* How an event runs through the core, and what follows from it. The loop's thread. */
#ifndef COORDINATOR_JOBS_STEP_H
#define COORDINATOR_JOBS_STEP_H

#include "coordinator/job/jobs.h"

/* What follows from the core's answers. A table, because what it names steps in its turn (follow_up.h). */
struct follow_up {
	/* The actions of an update, in their order. in: what the event brought that the update answers. */
	void (*carry_out)(struct jobs *jobs, const struct update *u, const struct incoming *in);
	void (*stepped)(struct jobs *jobs);    /* the event and all that were deferred meanwhile are carried out */
	void (*films_free)(struct jobs *jobs); /* some live job is no longer busy */
};

/* Gives the event to the core and carries out the update and all that follows from it. */
void jobs_step(struct jobs *jobs, struct event *ev);
/* The same, of an event that brought more (incoming.h). Not while an update is carried out. */
void jobs_step_with(struct jobs *jobs, struct event *ev, const struct incoming *in);
/* Later, when the current update is carried out. Copies the text. */
void jobs_defer(struct jobs *jobs, const struct event *ev);
void jobs_break(struct jobs *jobs, uint64_t job, const char *text); /* it cannot go on */

/* Some live job is no longer busy: what waited for its canvas goes on. Live jobs that have ended are gone then. */
void jobs_films_free(struct jobs *jobs);

#endif
