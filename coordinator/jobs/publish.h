/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Work on a whole film: estimating its error, writing its image into the spool. Runs in the pool; meanwhile the live
 * job is busy and its results wait. Started and finished on the loop's thread. Starting allocates nothing and cannot
 * fail; a final image for which there is no memory or disk space is made again later.
 */
#ifndef COORDINATOR_JOBS_PUBLISH_H
#define COORDINATOR_JOBS_PUBLISH_H

#include "coordinator/live_job/jobs.h"

void publish_start(struct jobs *jobs, struct live_job *job, enum publish_what what, uint64_t rounds);

#endif
