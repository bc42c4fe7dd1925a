/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All connections: they are let in, and they end. They call the jobs; what the jobs want of them comes by the table
 * that peers_init fills in (peer_calls.h). The loop's thread.
 */
#ifndef COORDINATOR_PEERS_PEERS_H
#define COORDINATOR_PEERS_PEERS_H

#include "coordinator/peers/session.h"

/* jobs, tls are set; the jobs' loop is. Fills in jobs->peers. */
void peers_init(struct peers *s);
void peers_accept(struct peers *s); /* somebody calls */
void peers_tick(struct peers *s);   /* every TICK_MS */
void peers_stop(struct peers *s);   /* closes the listener and all connections */

#endif
