/* SPDX-License-Identifier: Apache-2.0 */
/* Opening and closing of the jobs. The loop's thread. */
#ifndef COORDINATOR_JOBS_START_H
#define COORDINATOR_JOBS_START_H

#include "coordinator/job/jobs.h"

/* config, peers, stop, loop are set. Opens spool, ledger and core, and begins to read the jobs of the last run
 * (recovery.h). An error leaves what jobs_stop and jobs_close take. */
void jobs_init(struct jobs *jobs);
int jobs_open(struct jobs *jobs, struct error *e);
void jobs_tick(struct jobs *jobs);  /* every TICK_MS */
void jobs_stop(struct jobs *jobs);  /* no more is begun; the loop ends when what is under way has ended */
void jobs_close(struct jobs *jobs); /* after the loop */

#endif
