/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Workers that disappeared one after the other while they held the same lease. A worker's supervisor reports, when it
 * reconnects, which lease ended its render process, and that counts as a failure (failure_quorum.h); this list proves
 * that it held the lease. A worker that reconnects or is heard again was not lost by the lease: machines are switched
 * off, workers are killed, racks lose power. Workers that never return count against the lease only if LOST_FATAL of
 * them did so with nothing merged in between. If each holder of a lease disappears with probability 1/4, that happens
 * once in 65,536 leases; a farm that is switched off counts once per worker. As many certificates are required as in
 * failure_quorum.h. Pure.
 */
#ifndef COORDINATOR_CORE_LOST_HOLDERS_H
#define COORDINATOR_CORE_LOST_HOLDERS_H

#include "coordinator/core/slot.h"

#include <stdbool.h>

struct farm;
struct identity;
struct lease;

/* Adds the worker of this lease, which has disappeared or is silent: the lease is dropped, and the job ends if it
 * was one too many. */
void lost_holders_add(struct farm *f, struct lease *l);
bool lost_holders_have(const struct lost_holders *l, const struct identity *who);
/* Removes a worker; true if it was in the list. */
bool lost_holders_remove(struct lost_holders *l, const struct identity *who);

#endif
