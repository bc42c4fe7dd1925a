/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tasks that read whole films: estimating the error, writing an image into the spool. They run in the pool; meanwhile
 * the live job is busy and its results wait. Started and finished on the loop's thread. Starting a task allocates
 * nothing and cannot fail; a final image that fails for lack of memory or disk space is made again later.
 */
#ifndef COORDINATOR_JOBS_PUBLISH_H
#define COORDINATOR_JOBS_PUBLISH_H

#include "coordinator/live_job/jobs.h"

void publish_start(struct jobs *jobs, struct live_job *job, enum publish_kind kind, uint64_t rounds);

#endif
