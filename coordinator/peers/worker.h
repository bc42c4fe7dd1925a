/* SPDX-License-Identifier: Apache-2.0 */
/* A worker's side of a session. The loop's thread. */
#ifndef COORDINATOR_PEERS_WORKER_H
#define COORDINATOR_PEERS_WORKER_H

#include "coordinator/peers/session.h"

/* Handles a message. May take over the envelope. */
void worker_handle_message(struct session *p, struct envelope *env);
void worker_note_partial(void *session); /* call when a part of an incomplete message has arrived */

#endif
