/* SPDX-License-Identifier: Apache-2.0 */
/* What a job goes through: submitted, bootstrap, rounds, the bounds, its end. */
#ifndef COORDINATOR_CORE_ROUNDS_H
#define COORDINATOR_CORE_ROUNDS_H

#include "coordinator/core/event.h"
#include "coordinator/core/state.h"

enum { PRIORITY_MAX = 100 };
void rounds_submit(struct farm *f, const struct event *ev);
void rounds_cancel(struct farm *f, const struct event *ev);
void rounds_started(struct farm *f, struct job *j);		/* a lease of it is about to be sent */
void rounds_enlist(struct farm *f, struct job *j);		/* its id is new */
void rounds_forget(struct farm *f, struct job *j);		/* it has ended */
enum job_end rounds_bound(const struct job *j, double elapsed); /* that is met, the error apart */
void rounds_reject(struct farm *f, const struct event *ev, const char *text);
void rounds_opened(struct farm *f, struct job *j, bool black); /* b and seeds are there */
/* The bounds, when a round is complete: so many seconds after the first lease. */
void rounds_settle(struct farm *f, struct job *j, double elapsed);
void rounds_complete(struct farm *f, struct job *j);
void rounds_prepared(struct farm *f, const struct event *ev);
void rounds_error_known(struct farm *f, const struct event *ev);
void rounds_image_known(struct farm *f, const struct event *ev);
void rounds_end(struct farm *f, struct job *j, enum job_end end, const char *text);

void rounds_place(struct farm *f, struct job *j); /* among the live ones: by priority, then id */
void rounds_remove(struct farm *f, const struct job *j);

#endif
