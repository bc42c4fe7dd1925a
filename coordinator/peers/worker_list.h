/* SPDX-License-Identifier: Apache-2.0 */
/* The answer to WorkerList. The loop's thread. */
#ifndef COORDINATOR_PEERS_WORKER_LIST_H
#define COORDINATOR_PEERS_WORKER_LIST_H

#include "coordinator/peers/session.h"

/* Sends the client all workers that are connected, in the order in which they came. If there is no memory for that,
 * ends the connection with Fault. */
void worker_list_send(struct session *p);

#endif
