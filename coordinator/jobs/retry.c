/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/retry.h"

#include "coordinator/jobs/dispatch.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/finish.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/jobs/step.h"

void retry_tick(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live; job; job = job->next) {
		if (jobs_now(jobs) < job->try_again || job->busy)
			continue;
		if (job->unpublished) {
			job->unpublished = false;
			publish_start(jobs, job, PUBLISH_RESULT, job->unpublished_rounds);
		}
		if (job->unrecorded) {
			job->unrecorded = false;
			finish_ended(jobs);
			return; /* the list may have changed; continue next time */
		}
		if (job->unprepared && !job->ended) {
			struct event ev = {.kind = EVENT_TICK};
			dispatch_prepare(jobs, job);
			jobs_step(jobs, &ev);
			return;
		}
		if (job->held && !job->ended && durable_mend(jobs, job) == 0)
			return;
	}
}
