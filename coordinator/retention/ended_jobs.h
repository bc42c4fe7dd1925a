/* SPDX-License-Identifier: Apache-2.0 */
/* The records of the last ENDED_MAX jobs that ended, oldest first. The loop's thread. */
#ifndef COORDINATOR_RETENTION_ENDED_JOBS_H
#define COORDINATOR_RETENTION_ENDED_JOBS_H

#include "coordinator/job/jobs.h"

/* Reads those of earlier runs. One that cannot be read is logged and skipped. */
int ended_jobs_open(struct jobs *jobs, struct error *e);
void ended_jobs_add(struct jobs *jobs, const struct job_record *r); /* adds a job that has ended */
void ended_jobs_remove(struct jobs *jobs, uint64_t job);	    /* removes a job that continues, or is cleared */
struct job_record *ended_jobs_find(const struct jobs *jobs, uint64_t job); /* NULL: it is not among them */

#endif
