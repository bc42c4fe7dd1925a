/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Workers that went while they held the same lease, in a row. A worker that renders in a process of its own says
 * itself, when it calls again, which lease ended that process, and that counts as a failure (failure_quorum.h); the
 * list knows that it had the lease. Who calls again, or was silent and is heard, has not been lost by the lease
 * whatever else it says: machines are switched off, workers are killed, racks lose their power. Those that are never
 * heard of again count against the lease only when there are LOST_FATAL of them with nothing merged in between: where
 * each holder of a lease vanishes with a chance of 1/4 that happens once in 65,536 leases, and a whole farm that is
 * switched off counts once for each. Of as many certificates as failers want. Pure but for the list.
 */
#ifndef COORDINATOR_CORE_LOST_H
#define COORDINATOR_CORE_LOST_H

#include "coordinator/core/slot.h"

#include <stdbool.h>
#include <stdint.h>

struct farm;
struct identity;
struct lease;
struct peer;

/* The worker of this lease has gone, or is silent: the lease is dropped, and the job ends where it was one too many. */
void lost_lease(struct farm *f, struct lease *l);
/* It was among them, and is no longer. */
bool lost_take(struct lost *l, const struct identity *who);

#endif
