/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All connections: accepting and closing them. They call the jobs; the jobs call them through the table that peers_init
 * fills in (peer_calls.h). The loop's thread.
 */
#ifndef COORDINATOR_PEERS_PEERS_H
#define COORDINATOR_PEERS_PEERS_H

#include "coordinator/peers/session.h"

/* jobs, tls and the jobs' loop must be set. Fills in jobs->peers. */
void peers_init(struct peers *s);
void peers_accept(struct peers *s, struct listener *source); /* accepts a new connection */
void peers_tick(struct peers *s);			     /* call every TICK_MS */
void peers_stop(struct peers *s);			     /* closes the listeners and all connections */

#endif
