/* SPDX-License-Identifier: Apache-2.0 */
/* Jobs as they are listed and shown. The loop's thread. */
#ifndef COORDINATOR_JOBS_LISTING_H
#define COORDINATOR_JOBS_LISTING_H

#include "coordinator/live_job/jobs.h"

/* false: no such job. */
bool jobs_view(struct jobs *jobs, uint64_t job, struct job_view *v);
/* A live job as it will be once no thread reads its films. false: the core has forgotten it. */
bool jobs_view_end(const struct jobs *jobs, const struct live_job *job, struct job_view *v);
/* All live jobs and the last ended_most that ended (at most ENDED_MAX), sorted by id; mem_alloc'd. */
size_t jobs_views(struct jobs *jobs, size_t ended_most, struct job_view **views);

#endif
