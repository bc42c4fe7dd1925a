/* SPDX-License-Identifier: Apache-2.0 */
/* Live jobs that end. The loop's thread. */
#ifndef COORDINATOR_JOBS_FINISH_H
#define COORDINATOR_JOBS_FINISH_H

#include "coordinator/job/jobs.h"

/* Those that the core has ended and whose films are free: written down, told to the workers, let go. Then extensions
 * that waited for one of them go on. */
void finish_ended(struct jobs *jobs);

#endif
