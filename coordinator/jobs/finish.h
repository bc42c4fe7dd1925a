/* SPDX-License-Identifier: Apache-2.0 */
/* Finishes live jobs. The loop's thread. */
#ifndef COORDINATOR_JOBS_FINISH_H
#define COORDINATOR_JOBS_FINISH_H

#include "coordinator/live_job/jobs.h"

/* Finishes all jobs that the core has ended and whose films are free: writes the record, tells workers, frees memory.
 * Then handles extensions that waited for these jobs. */
void finish_ended(struct jobs *jobs);
/* Call after a job was cancelled. Returns 0 if it would stay cancelled after a crash of the coordinator, even if a
 * thread still reads its films; otherwise an error that says why not. */
int finish_check_cancelled(struct jobs *jobs, uint64_t id, struct error *e);

#endif
