/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What is kept of a job that is done, so that it can go on (extend.h): its last checkpoint and the journal behind it,
 * and jobs/jN/order (store/row_file.h). The films of the jobs that ended first go when all of them are more than the
 * limit, and all of them when a job that runs has no room; the results stay. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_KEEP_H
#define COORDINATOR_RETENTION_KEEP_H

#include "coordinator/job/jobs.h"

/* Of a job that has just ended. false: it cannot go on, and nothing is to be kept. */
bool keep_order(struct jobs *jobs, const struct live_job *job);
void keep_drop(const struct jobs *jobs, uint64_t job);
uint64_t keep_bytes(const struct jobs *jobs, uint64_t job); /* on the disk */
bool keep_drop_all(const struct jobs *jobs);		    /* of listed jobs; true: there was something */
void keep_trim(const struct jobs *jobs);		    /* after jobs have ended, and at the start */

#endif
