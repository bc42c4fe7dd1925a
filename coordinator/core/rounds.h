/* SPDX-License-Identifier: Apache-2.0 */
/* The life of a job: submitted, bootstrap, rounds, bounds, end. */
#ifndef COORDINATOR_CORE_ROUNDS_H
#define COORDINATOR_CORE_ROUNDS_H

#include "coordinator/core/event.h"
#include "coordinator/core/state.h"

enum { PRIORITY_MAX = 100 };
void rounds_submit(struct farm *f, const struct event *ev);
void rounds_cancel(struct farm *f, const struct event *ev);
void rounds_start_job(struct farm *f, struct job *j);  /* call before a lease of the job is sent */
void rounds_add_job(struct farm *f, struct job *j);    /* adds a job with a new id to the lists */
void rounds_forget_job(struct farm *f, struct job *j); /* removes and frees a job that has ended */
/* The bound that is met, not counting the target error. */
enum job_end rounds_met_bound(const struct job *j, double elapsed);
void rounds_reject_event(struct farm *f, const struct event *ev, const char *text);
void rounds_start_rendering(struct farm *f, struct job *j, bool black); /* b and seeds exist; a black job ends here */
/* Checks the bounds after a complete round. elapsed: seconds from the first lease to the end of that round. */
void rounds_check_bounds(struct farm *f, struct job *j, double elapsed);
/* A round, or the bootstrap, has become complete. */
void rounds_handle_round_done(struct farm *f, struct job *j);
void rounds_handle_prepared(struct farm *f, const struct event *ev);
void rounds_handle_error_estimated(struct farm *f, const struct event *ev);
void rounds_handle_image_published(struct farm *f, const struct event *ev);
void rounds_end_job(struct farm *f, struct job *j, enum job_end end, const char *text);

void rounds_insert_live(struct farm *f, struct job *j); /* into the list of live jobs, sorted by priority, then id */
void rounds_remove_live(struct farm *f, const struct job *j);

#endif
