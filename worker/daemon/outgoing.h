/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Messages that a worker sends; nothing happens while it is not connected. Loop's thread. If a message cannot be packed
 * for lack of memory, the connection ends: everything is sent again on the next one.
 */
#ifndef WORKER_DAEMON_OUTGOING_H
#define WORKER_DAEMON_OUTGOING_H

#include "worker/daemon/agent_state.h"

void send_message(struct agent *a, const Farm__Envelope *m); /* after welcome */
void send_request(struct agent *a);			     /* how many leases it wants to hold */
void send_job_get(struct agent *a, uint64_t job);
/* An empty text returns the lease without blame; own: this machine is at fault, not the job. */
void send_failed(struct agent *a, const struct lease_key *k, const char *text, bool own);
/* Returns a lease because the scene of another job is in memory (LeaseFailed.later): the coordinator asks again soon.
 */
void send_later(struct agent *a, const struct lease_key *k, const char *text);
/* The maker of the chain states in the grant is at fault. */
void send_bad_states(struct agent *a, const struct grant *g, const char *text);
/* Once per connection, and not before the coordinator has described the job: another one may have its number now. */
void send_result(struct agent *a, struct lease_task *l);

#endif
