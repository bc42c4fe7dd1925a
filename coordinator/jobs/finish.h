/* SPDX-License-Identifier: Apache-2.0 */
/* Finishes live jobs. The loop's thread. */
#ifndef COORDINATOR_JOBS_FINISH_H
#define COORDINATOR_JOBS_FINISH_H

#include "coordinator/job/jobs.h"

/* Finishes all jobs that the core has ended and whose films are free: record, workers, memory. Then handles
 * extensions that waited for them. */
void finish_ended(struct jobs *jobs);

#endif
