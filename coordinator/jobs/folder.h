/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's folder that somebody removes, or moves away, while the job runs: it is made anew, and all that the job needs
 * to go on is written into it, from memory and from the files that are still open. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_FOLDER_H
#define COORDINATOR_JOBS_FOLDER_H

#include "coordinator/job/jobs.h"

void folder_tick(struct jobs *jobs); /* looks every second */

#endif
