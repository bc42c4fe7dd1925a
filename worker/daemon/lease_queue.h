/* SPDX-License-Identifier: Apache-2.0 */
/* Jobs and leases of the worker: what it has been granted, fetches, builds, renders, and sends until it is
 * acknowledged. Loop's thread. */
#ifndef WORKER_DAEMON_LEASE_QUEUE_H
#define WORKER_DAEMON_LEASE_QUEUE_H

#include "worker/daemon/agent_state.h"

void lease_queue_welcome(struct agent *a); /* (re)connected: asks for work, offers what is still unsent */
void lease_queue_message(struct agent *a, struct envelope *env, const unsigned char *payload, size_t size);
void lease_queue_leave(struct agent *a);	 /* gives back what has not begun */
void lease_queue_stop_all(struct agent *a);	 /* gives up what runs */
enum { STALL_LOOKS = 8 };			 /* without progress, until a thread hangs */
bool lease_queue_watch(struct agent *a);	 /* true: a thread hangs that did not at the last look */
bool lease_queue_is_idle(const struct agent *a); /* no lease is at work, none waits to be acknowledged */
void lease_queue_close(struct agent *a);	 /* after the thread pool has been closed */

#endif
