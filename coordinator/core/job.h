/* SPDX-License-Identifier: Apache-2.0 */
/* A job and its slots. */
#ifndef COORDINATOR_CORE_JOB_H
#define COORDINATOR_CORE_JOB_H

#include "coordinator/core/event.h"
#include "coordinator/core/state.h"

/* Returns NULL and sets *refusal to a sentence if the job is refused. */
struct job *job_new(struct farm *f, const struct event_submit *e, const char **refusal);
void job_free(struct job *j);

bool job_is_live(const struct job *j);
bool job_is_schedulable(const struct job *j); /* leases may be handed out */
bool job_is_held(const struct job *j);
bool job_has_answers(const struct job *j); /* at least one result was merged or noted */
/* Seconds since the job's first lease, not counting the time it was held; NAN: no lease was sent yet. */
double job_elapsed(const struct job *j, double now);
struct slot *job_get_slot(const struct job *j, uint32_t group, uint32_t part);
/* A slot whose lease can be handed out, of the first incomplete round if possible; NULL: none. */
struct slot *job_find_ready_slot(const struct job *j);
/* Moves the slot to the right list after its holders or its next epoch changed. */
void job_place_slot(struct job *j, struct slot *s);
void job_place_all_slots(struct job *j); /* places all slots, and recounts done and ahead from their progress */
double job_copy_timeout(const struct farm_config *c, const struct slot *s); /* see copy_timeout in struct farm_config */
/* Seconds after which a lease of this slot times out. */
double job_lease_timeout(const struct farm_config *c, const struct job *j, const struct slot *s);
/* The time from which on a second copy of the slot's lease may go out. */
double job_copy_due_time(const struct farm_config *c, const struct job *j, const struct slot *s);

/* Counts the slot's next epoch as merged. duration: seconds that the lease took, NAN if unknown. Returns true if the
 * slot's round is now complete. */
bool job_merge_epoch(struct job *j, struct slot *s, double now, double duration);
/* Marks leases of a new job as merged. next_epochs: see struct event_restore. */
void job_restore(struct job *j, enum lease_kind kind, const uint64_t *next_epochs, double now);
void job_raise_round_limit(struct job *j);	 /* raises the limit of rounds to that of the plan */
void job_open_rounds(struct job *j, double now); /* the bootstrap is complete: render leases begin */
/* Pins the job to this class unless it is pinned; job_unpin_if_untouched undoes it when nothing is merged or noted
 * and no lease is out. */
void job_pin(struct job *j, struct peer_class *c);
void job_unpin_if_untouched(struct job *j);
/* Whether it accepts results of workers of this class. */
bool job_accepts_class(const struct job *j, const struct peer_class *c);

#endif
