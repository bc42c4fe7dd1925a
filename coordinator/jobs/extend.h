/* SPDX-License-Identifier: Apache-2.0 */
/* Extends a job beyond its bounds (extend_plan.h), running or finished. The loop's thread. */
#ifndef COORDINATOR_JOBS_EXTEND_H
#define COORDINATOR_JOBS_EXTEND_H

#include "common/net/tls.h"
#include "coordinator/live_job/jobs.h"
#include "coordinator/retention/extend_plan.h"

/* Who requests it. */
struct requester {
	uint64_t peer;
	char owner[TLS_NAME_MAX + 1]; /* name in its certificate; "": none */
	bool unbounded;		      /* exempt from quotas */
};

/* Extends the job now, or when its films are free or have been read; then the peer gets its answer (peer_calls.h). A
 * second request of a peer meanwhile is refused. */
void extend_job(struct jobs *jobs, const struct requester *by, const struct extension *x);
/* Films are free or have been read, or a job has ended: handles waiting requests, in order. */
void extend_waiting(struct jobs *jobs);
void extend_forget(struct jobs *jobs, uint64_t peer); /* the peer is gone */

#endif
