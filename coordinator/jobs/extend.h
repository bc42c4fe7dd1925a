/* SPDX-License-Identifier: Apache-2.0 */
/* Extends jobs beyond their bounds (extend_plan.h), live or finished. The loop's thread. */
#ifndef COORDINATOR_JOBS_EXTEND_H
#define COORDINATOR_JOBS_EXTEND_H

#include "common/net/tls.h"
#include "coordinator/live_job/jobs.h"
#include "coordinator/retention/extend_plan.h"

/* The client that requests an extension. */
struct requester {
	uint64_t peer;
	char owner[TLS_NAME_MAX + 1]; /* name in its certificate; "": no certificate */
	bool is_exempt_from_quota;    /* exempt from quotas */
};

/* Extends the job now, or when its films are free or have been read. Then the peer is answered (peer_calls.h). A
 * second request of the same peer meanwhile is refused. */
void extend_job(struct jobs *jobs, const struct requester *requester, const struct extension *x);
/* Handles waiting requests, in order. Call when films are free or have been read, or a job has ended. */
void extend_handle_waiting(struct jobs *jobs);
void extend_forget_peer(struct jobs *jobs, uint64_t peer); /* call when the peer is gone */

#endif
