/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What peers ask for while the jobs of an earlier run are read (recovery.h): it waits, and is answered in the order in
 * which it came. Greetings, heartbeats and lists of jobs are answered at once. Who waits is sent a heartbeat as often
 * as workers must be heard. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_HELD_H
#define COORDINATOR_PEERS_HELD_H

#include "coordinator/peers/session.h"

/* true: it waits, and the envelope is taken; or there is too much that does, and the peer was told so. */
bool held_take(struct session *p, struct envelope *env);
void held_tick(struct session *p);
void held_drop(struct session *p); /* it goes */
/* The first that waits, which is the caller's from then on; false: nothing does. */
bool held_next(struct session *p, struct envelope *env);

#endif
