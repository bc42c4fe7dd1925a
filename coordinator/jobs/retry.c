/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/retry.h"

#include "coordinator/jobs/dispatch.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/finish.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/jobs/step.h"

void retry_tick(struct jobs *s)
{
	for (struct live_job *job = s->live; job; job = job->next) {
		if (jobs_now(s) < job->try_again || job->busy)
			continue;
		if (job->unpublished) {
			job->unpublished = false;
			publish_start(s, job, PUBLISH_RESULT, job->unpublished_rounds);
		}
		if (job->unrecorded) {
			job->unrecorded = false;
			finish_ended(s);
			return; /* the list may have changed; the others next time */
		}
		if (job->unprepared && !job->ended) {
			struct event ev = {.kind = EVENT_TICK};
			dispatch_prepare(s, job);
			jobs_step(s, &ev);
			return;
		}
		if (job->held && !job->ended && durable_mend(s, job) == 0)
			return;
	}
}
