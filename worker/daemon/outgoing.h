/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a worker says of jobs and leases; nothing where it is not connected. Loop's thread. A message that cannot be
 * packed for want of memory ends the connection: all is said again after the next.
 */
#ifndef WORKER_DAEMON_SAY_H
#define WORKER_DAEMON_SAY_H

#include "worker/daemon/agent_private.h"

void say_request(struct agent *a); /* how many leases it wants to hold */
void say_job_get(struct agent *a, uint64_t job);
/* An empty text gives the lease back without fault; own: this machine is at fault, not the job. */
void say_failed(struct agent *a, const struct lease_key *k, const char *text, bool own);
/* Who made the chain states that came with it is at fault. */
void say_bad_states(struct agent *a, const struct grant *g, const char *text);
void say_result(struct agent *a, struct lease_task *l); /* once a connection */

#endif
