/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads the jobs that had not ended in the last run, in the pool, while the coordinator listens: a spool of gigabytes
 * keeps nobody from an answer. Rows and plans are read before it listens; films follow, one job after the other. When
 * the last one has been read, the core is told of all of them, in the order of their ids. Until then no leases go out,
 * requests wait (held.h), and the status says "reading, N %".
 *
 * Jobs whose checkpoint or journal is damaged start over; those without folder, plan or scene fail with a sentence. An
 * error of the machine stops the coordinator, because another start may succeed, and so does -EPROTO: another version
 * wrote the data. Then nothing is changed: stored data is not given up because it could not be read. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_RECOVERY_H
#define COORDINATOR_JOBS_RECOVERY_H

#include "coordinator/live_job/jobs.h"

int recovery_begin(struct jobs *jobs, struct error *e); /* if there are no such jobs it is complete at once */
bool recovery_is_on(const struct jobs *jobs);
double recovery_share(const struct jobs *jobs); /* share of all bytes: 0 to 1 */
void recovery_stop(struct jobs *jobs);		/* stop soon, together with the loop */
void recovery_close(struct jobs *jobs);		/* after the loop has ended */

/* While recovery runs. */
bool recovery_view(const struct jobs *jobs, uint64_t job, struct job_view *v); /* false: not one of them */
size_t recovery_views(const struct jobs *jobs,
		      struct job_view *v); /* sorted by id. v: NULL: only returns their number */

#endif
