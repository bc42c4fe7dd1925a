/* SPDX-License-Identifier: Apache-2.0 */
/* What the core's update asks for, carried out action by action. The loop's thread. */
#ifndef COORDINATOR_JOBS_DISPATCH_H
#define COORDINATOR_JOBS_DISPATCH_H

#include "coordinator/job/jobs.h"

struct incoming;

/* in: what the event brought that the update answers. */
void dispatch_update(struct jobs *jobs, const struct update *u, const struct incoming *in);
/* All of its bootstrap is merged: its films, or another try later, when the disk has no room for them. */
void dispatch_prepare(struct jobs *jobs, struct live_job *job);

#endif
