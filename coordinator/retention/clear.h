/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Clears finished jobs by age and by space (age.h): at the start, every hour, and soon after a job has ended. It never
 * touches files of live jobs or of jobs being read for an extension, nor a result that a client is fetching or waits
 * for. First the record says that the result is deleted, and when; then the files are deleted. With its record, a job's
 * row and the rest of its folder go, too. All finished jobs are examined, for a few milliseconds per tick, so nobody
 * waits for it. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_CLEAR_H
#define COORDINATOR_RETENTION_CLEAR_H

#include "coordinator/live_job/jobs.h"

void clear_tick(struct jobs *jobs);
void clear_soon(struct jobs *jobs);  /* a job has ended */
void clear_close(struct jobs *jobs); /* after the loop */

#endif
