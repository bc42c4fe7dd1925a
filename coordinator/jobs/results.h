/* SPDX-License-Identifier: Apache-2.0 */
/* Passes results and failures of leases to the core. The loop's thread. */
#ifndef COORDINATOR_JOBS_RESULTS_H
#define COORDINATOR_JOBS_RESULTS_H

#include "coordinator/live_job/jobs.h"

/* Handles a LeaseResult or LeaseFailed, now, or when the films are free and the job's files have been read. May take
 * over envelope and payload. */
void results_handle(struct jobs *jobs, uint64_t peer, struct envelope *env, struct buf *payload);
/* Handles a message that was put off; the caller frees it. */
void results_handle_waiting(struct jobs *jobs, struct waiting_message *w);
/* Call when a worker leaves. Its failures count now, by what is known of the files so far, since a worker that hangs
 * reports that and leaves; its results are dropped. */
void results_release_peer(struct jobs *jobs, uint64_t peer);

#endif
