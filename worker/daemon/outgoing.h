/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The messages that a worker sends; nothing happens while it is not connected. If memory for a message is out, the
 * connection ends, and everything is sent again on the next one. The loop's thread.
 */
#ifndef WORKER_DAEMON_OUTGOING_H
#define WORKER_DAEMON_OUTGOING_H

#include "worker/daemon/agent_state.h"

void send_message(struct agent *a, const Farm__Envelope *m); /* any message */
void send_lease_request(struct agent *a);		     /* how many leases the worker wants to hold */
void send_job_get(struct agent *a, uint64_t job);	     /* asks for the description of a job */
/* Returns a lease as failed. With an empty text, nobody is blamed; worker_at_fault: this machine is at fault, not the
 * job. */
void send_lease_failed(struct agent *a, const struct lease_key *k, const char *text, bool worker_at_fault);
/* Returns a lease because the scene of another job is in memory (LeaseFailed.later): the coordinator will offer it
 * again soon. */
void send_lease_deferred(struct agent *a, const struct lease_key *k, const char *text);
/* Returns a lease because the chain states in its grant are invalid, and reports the worker that computed them. */
void send_bad_states(struct agent *a, const struct grant *g, const char *text);
/* Sends a result, at most once per connection, and only after the coordinator has described the job on this connection,
 * because a coordinator with another spool may have given the job's number to another job. */
void send_result(struct agent *a, struct lease_task *l);

#endif
