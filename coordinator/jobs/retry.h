/* SPDX-License-Identifier: Apache-2.0 */
/* What the disk did not take is tried again from time to time. The loop's thread. */
#ifndef COORDINATOR_JOBS_RETRY_H
#define COORDINATOR_JOBS_RETRY_H

#include "coordinator/job/jobs.h"

/* Of each live job whose time has come: its image, its record, its films, the journal for its results. */
void retry_tick(struct jobs *jobs);

#endif
