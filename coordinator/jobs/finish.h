/* SPDX-License-Identifier: Apache-2.0 */
/* Finishes live jobs. The loop's thread. */
#ifndef COORDINATOR_JOBS_FINISH_H
#define COORDINATOR_JOBS_FINISH_H

#include "coordinator/live_job/jobs.h"

/* Finishes all jobs that the core has ended and whose films are free: record, workers, memory. Then handles
 * extensions that waited for them. */
void finish_ended(struct jobs *jobs);
/* After a job was cancelled: 0 if it stays so when the coordinator is killed, even if a thread still reads its films;
 * or why not. */
int finish_cancelled(struct jobs *jobs, uint64_t job, struct error *e);

#endif
