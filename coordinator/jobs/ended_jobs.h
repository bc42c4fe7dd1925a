/* SPDX-License-Identifier: Apache-2.0 */
/* The records of the last ENDED_MAX jobs that ended, oldest first. The loop's thread. */
#ifndef COORDINATOR_JOBS_ENDED_JOBS_H
#define COORDINATOR_JOBS_ENDED_JOBS_H

#include "coordinator/job/jobs.h"

/* Reads those of earlier runs. One that cannot be read is logged and left out. */
int ended_jobs_open(struct jobs *jobs, struct error *e);
void ended_jobs_add(struct jobs *jobs, const struct job_record *r); /* it has ended */
void ended_jobs_remove(struct jobs *jobs, uint64_t job);	    /* it goes on */

#endif
