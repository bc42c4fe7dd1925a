/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What is kept of a finished job for extensions (extend.h): its films (the last checkpoint and the journal after it),
 * and its submission in the ledger. If all films together exceed the limit, those of the jobs that ended first are
 * deleted; if a running job has no room, all are. Results stay. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_KEEP_H
#define COORDINATOR_RETENTION_KEEP_H

#include "coordinator/job/jobs.h"

/* For a job that has just ended. false: it cannot be extended, and nothing need be kept. */
bool keep_films(const struct jobs *jobs, const struct live_job *job, const struct job_record *r);
void keep_drop(const struct jobs *jobs, uint64_t job);
bool keep_drop_all(const struct jobs *jobs); /* deletes the films of listed jobs; true: there were some */
void keep_trim(const struct jobs *jobs);     /* call after jobs have ended, and at the start */

#endif
