/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One peer's conversation: hello, then as a worker or as a client. Limits depend on where the conversation is. The
 * loop's thread.
 */
#ifndef COORDINATOR_PEERS_CONVERSATION_H
#define COORDINATOR_PEERS_CONVERSATION_H

#include "coordinator/peers/session.h"

extern const struct conn_events conversation_events; /* user: the session */

/* The jobs are there: what waited for them (held.h) is taken now. */
void conversations_go_on(struct peers *s);

#endif
