/* SPDX-License-Identifier: Apache-2.0 */
/* Carries out the core's update, action by action. The loop's thread. */
#ifndef COORDINATOR_JOBS_DISPATCH_H
#define COORDINATOR_JOBS_DISPATCH_H

#include "coordinator/live_job/jobs.h"

struct incoming;

/* in: data that came with the event. */
void dispatch_update(struct jobs *jobs, const struct update *u, const struct incoming *in);
/* Makes the films of a job whose bootstrap is merged; tries again later if the disk has no room. */
void dispatch_prepare(struct jobs *jobs, struct live_job *job);

#endif
