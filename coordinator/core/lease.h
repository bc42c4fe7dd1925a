/* SPDX-License-Identifier: Apache-2.0 */
/* One worker's hold on one open lease. Stored in its worker's table and linked to its slot. */
#ifndef COORDINATOR_CORE_LEASE_H
#define COORDINATOR_CORE_LEASE_H

#include "common/film/batch.h"
#include "coordinator/core/slot.h"

struct farm;
struct job;
struct peer;
struct slot;

struct lease_key lease_key(const struct lease *l);
struct lease *lease_of(const struct slot *s, const struct peer *p); /* NULL: holds none */

/* Gives the slot's open lease to a worker that wants one. */
void lease_send(struct farm *f, struct peer *p, struct job *j, struct slot *s);
/* Removes it from all lists; the slot moves to the right list. */
void lease_drop(struct farm *f, struct lease *l);
void lease_revoke(struct farm *f, struct lease *l); /* the same, and tells the worker */
/* The worker has delivered its result. */
void lease_deliver(struct farm *f, struct lease *l);
/* It timed out: the slot is free for others, but an answer still counts. */
void lease_expire(struct farm *f, struct lease *l);
void lease_revoke_slot(struct farm *f, struct slot *s); /* all holders */

#endif
