/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Clears finished jobs by age and by space (expiry.h): at the start, every hour, and soon after a job has ended. Never
 * touches files of live jobs or of jobs being read for an extension, nor a result that a client is fetching or waits
 * for. The record is changed first to say that the result is deleted, and when; then the files are deleted. A job
 * whose record is dropped also loses its row and the rest of its folder. All finished jobs are examined, for a few
 * milliseconds per tick, so that nobody waits for it. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_CLEARING_H
#define COORDINATOR_RETENTION_CLEARING_H

#include "coordinator/live_job/jobs.h"

void clearing_tick(struct jobs *jobs);
void clearing_schedule_soon(struct jobs *jobs); /* call when a job has ended */
void clearing_close(struct jobs *jobs);		/* call after the loop has ended */

#endif
