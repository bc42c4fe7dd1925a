/* SPDX-License-Identifier: Apache-2.0 */
/* Retries what the disk refused. The loop's thread. */
#ifndef COORDINATOR_JOBS_RETRY_H
#define COORDINATOR_JOBS_RETRY_H

#include "coordinator/job/jobs.h"

/* For each live job whose time has come: its image, record, films, and the journal for its results. */
void retry_tick(struct jobs *jobs);

#endif
