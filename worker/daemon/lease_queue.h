/* SPDX-License-Identifier: Apache-2.0 */
/* Jobs and leases of the worker: grants, fetching, building, rendering, and sending until acknowledged. Loop's
 * thread. */
#ifndef WORKER_DAEMON_LEASE_QUEUE_H
#define WORKER_DAEMON_LEASE_QUEUE_H

#include "worker/daemon/agent_state.h"

void lease_queue_welcome(struct agent *a); /* (re)connected: asks for work, sends unsent results */
void lease_queue_message(struct agent *a, struct envelope *env, const unsigned char *payload, size_t size);
void lease_queue_leave(struct agent *a);	 /* returns what has not started */
void lease_queue_stop_all(struct agent *a);	 /* gives up what is running */
bool lease_queue_is_idle(const struct agent *a); /* nothing is being rendered, and nothing waits to be acknowledged */
void lease_queue_close(struct agent *a);	 /* call after the thread pool has been closed */

#endif
