/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The protocol of one peer: hello, then as a worker or as a client. Limits depend on the state. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_CONVERSATION_H
#define COORDINATOR_PEERS_CONVERSATION_H

#include "coordinator/peers/session.h"

extern const struct conn_events conversation_events; /* user: the session */

/* Handles requests that waited for others, as many as there is time for. */
void conversations_tick(struct peers *s);
/* The jobs have been read: handles the requests that waited for that (held.h). */
void conversations_go_on(struct peers *s);

#endif
