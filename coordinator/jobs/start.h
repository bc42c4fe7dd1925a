/* SPDX-License-Identifier: Apache-2.0 */
/* Opens and closes the jobs. The loop's thread. */
#ifndef COORDINATOR_JOBS_START_H
#define COORDINATOR_JOBS_START_H

#include "coordinator/live_job/jobs.h"

/* config, peers, stop, loop must be set. Opens spool, ledger and core, and starts to read the jobs of the last run
 * (recovery.h). After an error call jobs_stop and jobs_close. */
void jobs_init(struct jobs *jobs);
int jobs_open(struct jobs *jobs, struct error *e);
void jobs_tick(struct jobs *jobs);  /* every TICK_MS */
void jobs_stop(struct jobs *jobs);  /* nothing new is started; the loop ends when running work has ended */
void jobs_close(struct jobs *jobs); /* after the loop */

#endif
