/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What is kept of a finished job: for extensions (extend.h) its films (the last checkpoint and the journal after it),
 * and its submission in the ledger; for lists its record. If all films together exceed the limit, those of the jobs
 * that ended first are deleted; if a running job has no room, all are. Results stay. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_KEEP_H
#define COORDINATOR_RETENTION_KEEP_H

#include "coordinator/live_job/jobs.h"

/* For a job that has just ended. false: it cannot be extended, and nothing need be kept. */
bool keep_films(const struct jobs *jobs, const struct live_job *job, const struct job_record *r);
void keep_drop(const struct jobs *jobs, uint64_t job);
/* Bytes of a job's films. false: its folder could not be read, which is logged. */
bool keep_bytes(const struct jobs *jobs, uint64_t job, uint64_t *bytes);
bool keep_drop_all(const struct jobs *jobs); /* deletes the films of listed jobs; true: some were deleted */
void keep_trim(const struct jobs *jobs);     /* call after jobs have ended, and at the start */

/* The records of the last ENDED_MAX jobs that ended, oldest first. Reads those of earlier runs; one that cannot be read
 * is logged and skipped. */
int ended_jobs_open(struct jobs *jobs, struct error *e);
void ended_jobs_add(struct jobs *jobs, const struct job_record *r); /* adds a job that has ended */
void ended_jobs_remove(struct jobs *jobs, uint64_t job);	    /* removes a job that continues, or is cleared */
struct job_record *ended_jobs_find(const struct jobs *jobs, uint64_t job); /* NULL: it is not among them */

#endif
