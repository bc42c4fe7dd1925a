/* SPDX-License-Identifier: Apache-2.0 */
/* Leases: one worker's hold on the open lease of one slot (struct lease in slot.h). */
#ifndef COORDINATOR_CORE_LEASE_H
#define COORDINATOR_CORE_LEASE_H

#include "common/film/batch.h"
#include "coordinator/core/slot.h"

struct farm;
struct job;
struct peer;
struct slot;

struct lease_key lease_get_key(const struct lease *l);
struct lease *lease_find(const struct slot *s, const struct peer *p); /* NULL: p does not hold the slot's lease */

/* Gives the slot's open lease to a worker that wants one. */
void lease_send(struct farm *f, struct peer *p, struct job *j, struct slot *s);
/* Ends the lease: frees its entry, and moves its slot and its worker to the right lists. */
void lease_drop(struct farm *f, struct lease *l);
void lease_revoke(struct farm *f, struct lease *l); /* like lease_drop(), and tells the worker */
/* Notes that the result has arrived and will be judged later: the worker may get another lease meanwhile. */
void lease_mark_delivered(struct farm *f, struct lease *l);
/* The lease has timed out: its slot is free for other workers, but an answer still counts. */
void lease_expire(struct farm *f, struct lease *l);
void lease_revoke_slot(struct farm *f, struct slot *s); /* revokes the leases of all holders */

#endif
