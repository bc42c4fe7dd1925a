/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Restores a job's folder if it is removed or moved away while the job runs: creates it again and writes everything
 * that the job needs into it, from memory and from files that are still open. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_FOLDER_H
#define COORDINATOR_JOBS_FOLDER_H

#include "coordinator/live_job/jobs.h"

void folder_tick(struct jobs *jobs); /* checks every second */

#endif
