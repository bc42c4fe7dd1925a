/* SPDX-License-Identifier: Apache-2.0 */
/* Opens and closes the jobs. The loop's thread. */
#ifndef COORDINATOR_JOBS_LIFECYCLE_H
#define COORDINATOR_JOBS_LIFECYCLE_H

#include "coordinator/live_job/jobs.h"

/* Before jobs_init, config, peers, stop and loop must be set. jobs_open opens spool, ledger and core, and starts to
 * read the jobs of the last run (recovery.h). After an error call jobs_stop and jobs_close. */
void jobs_init(struct jobs *jobs);
int jobs_open(struct jobs *jobs, struct error *e);
void jobs_tick(struct jobs *jobs);  /* call every TICK_MS */
void jobs_stop(struct jobs *jobs);  /* starts nothing new; the loop ends when running work has ended */
void jobs_close(struct jobs *jobs); /* call after the loop has ended */

#endif
