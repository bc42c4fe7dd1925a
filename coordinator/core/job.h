/* SPDX-License-Identifier: Apache-2.0 */
/* A job and its slots. */
#ifndef COORDINATOR_CORE_JOB_H
#define COORDINATOR_CORE_JOB_H

#include "coordinator/core/event.h"
#include "coordinator/core/state.h"

/* NULL, with a sentence, if it is refused. */
struct job *job_new(struct farm *f, const struct event_submit *e, const char **refused);
void job_free(struct job *j);

bool job_is_live(const struct job *j);
bool job_is_open(const struct job *j); /* leases may be handed out and merged */
bool job_is_held(const struct job *j);
bool job_is_proven(const struct job *j); /* something of it was computed */
double job_elapsed(const struct job *j,
		   double now); /* s since its first lease, without the time it was held; NAN: none yet */
struct slot *job_slot(const struct job *j, uint32_t group, uint32_t part);
struct slot *job_ready(const struct job *j); /* NULL: none */
/* Moves the slot to the right list after its holders or its next epoch changed. */
void job_place(struct job *j, struct slot *s);
void job_place_all(struct job *j); /* and recomputes counts, from the progress of each slot */
double job_idle_timeout(const struct farm_config *c, const struct slot *s); /* see farm_config */
double job_lease_timeout(const struct farm_config *c, const struct job *j, const struct slot *s);
double job_straggles_at(const struct farm_config *c, const struct job *j, const struct slot *s);

/* Call when the slot's next epoch is merged. true: its round is complete. */
bool job_merge(struct job *j, struct slot *s, double now, double duration);
/* Marks leases of a new job as merged. next: see struct event_restore. */
void job_restore(struct job *j, enum lease_kind kind, const uint64_t *next, double now);
void job_raise_limit(struct job *j);		 /* to the plan's rounds */
void job_open_rounds(struct job *j, double now); /* render leases after the bootstrap */
/* Pins the job to this class; unpinned when nothing is merged and no lease is out. */
void job_pin(struct job *j, struct peer_class *c);
void job_unpin_if_untouched(struct job *j);
bool job_takes(const struct job *j, const struct peer_class *c); /* from workers of this class */

#endif
