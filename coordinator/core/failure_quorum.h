/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The workers that failed with the same lease, or with leases of the same job. If three different workers failed, the
 * lease or job is at fault. A worker counts once, however often it failed or reconnected. The three must have as many
 * different certificates (up to three) as the farm knows, because one certificate can be used under any number of
 * names. Pure.
 */
#ifndef COORDINATOR_CORE_FAILURE_QUORUM_H
#define COORDINATOR_CORE_FAILURE_QUORUM_H

#include "coordinator/core/slot.h"

#include <stdbool.h>
#include <stdint.h>

struct farm;
struct identity;

/* Returns how many different certificates the workers in a quorum must have: as many as the workers that are not
 * quarantined have, at most FAILURE_QUORUM_SIZE. */
uint32_t failure_quorum_size_required(const struct farm *f);

/* Adds a worker. Returns true if the quorum is reached: the lease or job is at fault. */
bool failure_quorum_add(struct failure_quorum *l, const struct farm *f, const struct identity *identity);

#endif
