/* SPDX-License-Identifier: Apache-2.0 */
/* A job goes on beyond its bounds (extend_plan.h), while it runs or after it is done. The loop's thread. */
#ifndef COORDINATOR_JOBS_EXTEND_H
#define COORDINATOR_JOBS_EXTEND_H

#include "common/net/tls.h"
#include "coordinator/job/extend_plan.h"
#include "coordinator/job/jobs.h"

/* Who wants it. */
struct requester {
	uint64_t peer;
	char owner[TLS_NAME_MAX + 1]; /* by its certificate; "": none */
	bool unbounded;		      /* quotas do not hold for it */
};

/* Does it, or puts it off until the job's films are free or read; the peer gets its answer (peer_calls.h). One at a
 * time of a peer: another one meanwhile is refused. */
void extend_job(struct jobs *jobs, const struct requester *by, const struct extension *x);
/* Films are free or read, or a job has ended: those that were put off, in the order in which they came. */
void extend_waiting(struct jobs *jobs);
void extend_forget(struct jobs *jobs, uint64_t peer); /* it has gone */

#endif
