/* SPDX-License-Identifier: Apache-2.0 */
/* Passes results and failures of leases to the core. The loop's thread. */
#ifndef COORDINATOR_JOBS_RESULTS_H
#define COORDINATOR_JOBS_RESULTS_H

#include "coordinator/job/jobs.h"

/* A LeaseResult, or a LeaseFailed that refuses chain states: now, or when the films are free. May take either. */
void results_take(struct jobs *jobs, uint64_t peer, struct envelope *env, struct buf *payload);
/* Any other LeaseFailed. */
void results_take_failure(struct jobs *jobs, uint64_t peer, const Farm__LeaseFailed *f);

#endif
