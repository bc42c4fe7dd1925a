/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Work on a whole film: its error, its image as EXR in the spool. Runs in the pool; the live job is busy meanwhile and
 * its results wait. Started and finished on the loop's thread. Starting allocates nothing and cannot fail; an image of
 * the result for which there is no memory or no disk is made again later.
 */
#ifndef COORDINATOR_JOBS_PUBLISH_H
#define COORDINATOR_JOBS_PUBLISH_H

#include "coordinator/job/jobs.h"

void publish_start(struct jobs *jobs, struct live_job *job, enum publish_what what, uint64_t rounds);

#endif
