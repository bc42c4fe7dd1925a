/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads the jobs that had not ended in the last run, in the pool, while the coordinator already listens, so that
 * nobody has to wait for an answer until a spool of gigabytes has been read. Rows and plans are read before it
 * listens; films follow, one job after the other. When the last one has been read, the core is told of all of them,
 * in the order of their ids. Until then no leases go out, requests wait (request_queue.h), and the status says
 * "reading, N %".
 *
 * Jobs whose checkpoint or journal is damaged start over; those without folder, plan or scene fail with a sentence.
 * An error of the machine stops the coordinator, because another start may succeed, and so does -EPROTO: another
 * version wrote the data. In both cases nothing is changed: stored data is not given up because it could not be read.
 * The loop's thread.
 */
#ifndef COORDINATOR_JOBS_RECOVERY_H
#define COORDINATOR_JOBS_RECOVERY_H

#include "coordinator/live_job/jobs.h"

int recovery_begin(struct jobs *jobs, struct error *e); /* complete at once if there are no such jobs */
bool recovery_is_running(const struct jobs *jobs);
double recovery_progress(const struct jobs *jobs); /* fraction of all bytes that have been read, 0 to 1 */
void recovery_stop(struct jobs *jobs);		   /* makes the pool stop soon; the loop is ending */
void recovery_close(struct jobs *jobs);		   /* call after the loop has ended */

/* While recovery runs: */
bool recovery_get_view(const struct jobs *jobs, uint64_t job, struct job_view *v); /* false: not one of these jobs */
/* Views all these jobs, sorted by id, and returns their number. v NULL: only returns the number. */
size_t recovery_list_views(const struct jobs *jobs, struct job_view *v);

#endif
