/* SPDX-License-Identifier: Apache-2.0 */
/* Gives results that wait in a job's journal (coordinator/live_job/late_results.h) to the core. The loop's thread. */
#ifndef COORDINATOR_JOBS_LATE_FEED_H
#define COORDINATOR_JOBS_LATE_FEED_H

#include "coordinator/live_job/jobs.h"

/* Drops the waiting results of a job, which are computed again instead. Returns false if the job has ended meanwhile
 * and is gone. */
bool late_results_drop_all(struct jobs *jobs, uint64_t id);
/* Gives the core all waiting results that can be merged now. Call after every step, and when films are free again. */
void late_results_feed(struct jobs *jobs);

#endif
