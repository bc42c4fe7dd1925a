/* SPDX-License-Identifier: Apache-2.0 */
/* Jobs and leases of the worker: grants, fetching of files, building, rendering, and sending results until they are
 * acknowledged. The loop's thread. */
#ifndef WORKER_DAEMON_LEASE_QUEUE_H
#define WORKER_DAEMON_LEASE_QUEUE_H

#include "worker/daemon/agent_state.h"

void lease_queue_on_connect(struct agent *a); /* on each new connection: requests leases, sends unsent results */
/* Handles a message of the coordinator. */
void lease_queue_handle_message(struct agent *a, struct envelope *env, const unsigned char *payload, size_t size);
void lease_queue_return_unstarted(struct agent *a); /* returns leases that have not started */
void lease_queue_stop_all(struct agent *a);	    /* tells running leases to stop */
bool lease_queue_is_idle(const struct agent *a);    /* nothing is being rendered, and no result waits for its answer */
void lease_queue_close(struct agent *a);	    /* call after the thread pool has been closed */

#endif
