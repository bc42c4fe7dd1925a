/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The protocol of one peer: hello, then messages as a worker or as a client. Size limits depend on the state of the
 * session. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_CONVERSATION_H
#define COORDINATOR_PEERS_CONVERSATION_H

#include "coordinator/peers/session.h"

extern const struct conn_events conversation_events; /* their user is the session */

/* Handles requests that waited for others, as many as there is time for. Call every TICK_MS. */
void conversations_tick(struct peers *s);
/* The jobs have been read: handles the requests that waited for that (request_queue.h). */
void conversations_resume(struct peers *s);

#endif
