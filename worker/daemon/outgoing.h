/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a worker sends; nothing where it is not connected. Loop's thread. A message that cannot be packed for want of
 * memory ends the connection: everything is sent again on the next one.
 */
#ifndef WORKER_DAEMON_OUTGOING_H
#define WORKER_DAEMON_OUTGOING_H

#include "worker/daemon/agent_state.h"

void send_message(struct agent *a, const Farm__Envelope *m); /* after welcome */
void send_request(struct agent *a);			     /* how many leases it wants to hold */
void send_job_get(struct agent *a, uint64_t job);
/* An empty text gives the lease back without fault; own: this machine is at fault, not the job. */
void send_failed(struct agent *a, const struct lease_key *k, const char *text, bool own);
/* Who made the chain states that came with it is at fault. */
void send_bad_states(struct agent *a, const struct grant *g, const char *text);
void send_result(struct agent *a, struct lease_task *l); /* once a connection */

#endif
