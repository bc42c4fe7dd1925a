/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finished jobs go by age and by space (age.h): at the start, every hour, and soon after a job has ended. Never a
 * living job's files nor those of one that is being read to go on, never a result that a client is fetching or waits
 * for. The record says first that the result is gone, and when; then the files go. With its record a job's row goes,
 * too, and all that is left in its folder. All finished jobs are looked at, a few milliseconds in each tick: nobody
 * waits for it. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_CLEAR_H
#define COORDINATOR_RETENTION_CLEAR_H

#include "coordinator/job/jobs.h"

void clear_tick(struct jobs *jobs);
void clear_soon(struct jobs *jobs);  /* a job has ended */
void clear_close(struct jobs *jobs); /* after the loop */

#endif
