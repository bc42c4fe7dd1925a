/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Workers that disappeared one after the other while they held the same lease. When such a worker reconnects, its
 * supervisor reports which lease ended its render process, and this counts as a failure (failure_quorum.h); the list
 * proves that the worker held the lease. A worker that reconnects or is heard again was not lost by the lease:
 * machines are switched off, workers are killed, racks lose power. Workers that never return count against the lease
 * only if LOST_HOLDERS_FATAL of them disappeared with nothing merged in between. If each holder of a lease disappears
 * with probability 1/4, that happens once in 65,536 leases; a farm that is switched off counts once per worker. The
 * workers must have as many different certificates as in failure_quorum.h. Pure.
 */
#ifndef COORDINATOR_CORE_LOST_HOLDERS_H
#define COORDINATOR_CORE_LOST_HOLDERS_H

#include "coordinator/core/slot.h"

#include <stdbool.h>

struct farm;
struct identity;
struct lease;

/* Drops the lease and adds its worker, which has disappeared or is silent, to the slot's list. Fails the job if the
 * list now reaches LOST_HOLDERS_FATAL with enough certificates. */
void lost_holders_add(struct farm *f, struct lease *l);
/* Whether the worker is in the list. */
bool lost_holders_contain(const struct lost_holders *l, const struct identity *identity);
/* Removes a worker from the list. Returns true if it was listed. */
bool lost_holders_remove(struct lost_holders *l, const struct identity *identity);

#endif
