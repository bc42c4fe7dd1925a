/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/retry.h"

#include "coordinator/jobs/dispatch.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/finish.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/jobs/step.h"

void retry_tick(struct jobs *s)
{
	for (struct live_job *o = s->orders; o; o = o->next) {
		if (jobs_now(s) < o->try_again || o->busy)
			continue;
		if (o->unpublished) {
			o->unpublished = false;
			publish_start(s, o, PUBLISH_RESULT, o->unpublished_rounds);
		}
		if (o->unrecorded) {
			o->unrecorded = false;
			finish_ended(s);
			return; /* the list may have changed; the others next time */
		}
		if (o->unprepared && !o->ended) {
			struct event ev = {.kind = EVENT_TICK};
			dispatch_prepare(s, o);
			jobs_step(s, &ev);
			return;
		}
		if (o->held && !o->ended && durable_mend(s, o) == 0)
			return;
	}
}
