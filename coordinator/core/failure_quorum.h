/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Workers that failed with the same thing. Three of them say that it is the thing's fault, each counted once however
 * often it failed and called again; of as many certificates, up to three, as the farm knows workers of, for whoever has
 * one can give himself any number of names. Pure but for the list.
 */
#ifndef COORDINATOR_CORE_FAILURE_QUORUM_H
#define COORDINATOR_CORE_FAILURE_QUORUM_H

#include "coordinator/core/slot.h"

#include <stdbool.h>
#include <stdint.h>

struct farm;
struct identity;

/* So many certificates must be among those who fail. */
uint32_t failure_quorum_certificates(const struct farm *f);

/* true: it is the thing's fault. */
bool failure_quorum_add(struct failure_quorum *l, const struct farm *f, const struct identity *who);

#endif
