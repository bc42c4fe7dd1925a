/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The workers that failed at the same thing. If three did, the thing is at fault. Each worker counts once, however
 * often it failed or reconnected, and they must have as many different certificates (up to three) as the farm knows,
 * because one certificate can be used under any number of names. Pure.
 */
#ifndef COORDINATOR_CORE_FAILURE_QUORUM_H
#define COORDINATOR_CORE_FAILURE_QUORUM_H

#include "coordinator/core/slot.h"

#include <stdbool.h>
#include <stdint.h>

struct farm;
struct identity;

/* This many certificates must be among those that failed. */
uint32_t failure_quorum_certificates(const struct farm *f);

/* true: the thing is at fault. */
bool failure_quorum_add(struct failure_quorum *l, const struct farm *f, const struct identity *who);

#endif
