/* SPDX-License-Identifier: Apache-2.0 */
/* What a connected worker may get: its place in the queue, its limit of leases, the jobs that it pauses with. */
#ifndef COORDINATOR_CORE_PEER_H
#define COORDINATOR_CORE_PEER_H

#include "coordinator/core/state.h"

void peer_set_state(struct farm *f, struct peer *p, enum peer_state s);
void peer_heard(struct farm *f, struct peer *p);
/* Adds it to the end of the queue or removes it, after its wish, leases or state changed. */
void peer_requeue(struct farm *f, struct peer *p);
bool peer_has_wish(const struct peer *p);

void peer_failed(const struct farm *f, struct peer *p, uint64_t job, bool own);
/* It returned a lease because another scene is in its memory. */
void peer_has_no_room(const struct farm *f, struct peer *p, uint64_t job);
void peer_succeeded(struct farm *f, struct peer *p, uint64_t job);
void peer_was_late(struct farm *f, struct peer *p);	      /* with a lease that others get now, or have answered */
double peer_avoids_until(const struct peer *p, uint64_t job); /* -INFINITY: it does not */
/* Until when it gets no lease of the job: it avoids the job, or its memory is full with another's scene. */
double peer_pauses_until(const struct peer *p, const struct job *j);
bool peer_waits_for_room(const struct peer *p, uint64_t job); /* its last lease of the job came back for that reason */
bool peer_lacks(const struct peer *p, uint64_t job); /* its last failure with the job was its own machine's fault */

#endif
