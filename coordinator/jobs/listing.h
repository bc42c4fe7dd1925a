/* SPDX-License-Identifier: Apache-2.0 */
/* Jobs as they are listed and shown. The loop's thread. */
#ifndef COORDINATOR_JOBS_LISTING_H
#define COORDINATOR_JOBS_LISTING_H

#include "coordinator/live_job/jobs.h"

/* Returns false if there is no such job. */
bool jobs_get_view(struct jobs *jobs, uint64_t id, struct job_view *v);
/* Views a live job as it will be once no thread reads its films. Returns false if the core has forgotten it. */
bool jobs_get_end_view(const struct jobs *jobs, const struct live_job *job, struct job_view *v);
/* Views all live jobs and the `max_ended` that ended last (at most ENDED_JOBS_MAX), sorted by id. Returns their
 * number; *views is mem_alloc'd. */
size_t jobs_list_views(struct jobs *jobs, size_t max_ended, struct job_view **views);

#endif
