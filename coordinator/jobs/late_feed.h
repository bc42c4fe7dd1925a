/* SPDX-License-Identifier: Apache-2.0 */
/* Results that wait in a job's journal (coordinator/job/late.h), from there to the core. The loop's thread. */
#ifndef COORDINATOR_JOBS_LATE_FEED_H
#define COORDINATOR_JOBS_LATE_FEED_H

#include "coordinator/job/jobs.h"

/* They are computed again, after all. */
void late_drop(struct jobs *jobs, struct live_job *job);
/* All that can count now do. After every step of the core, and when films are free again. */
void late_feed(struct jobs *jobs);

#endif
