/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Requests that wait, and are answered in order afterwards. While the jobs of an earlier run are read (recovery.h), all
 * do but hello, heartbeats and lists of jobs. At any time the requests of clients do, once those since the last tick
 * have taken HELD_REQUESTS_MS together: the loop has others to answer. Then connections take turns. Peers that wait,
 * also for the files of a submission to be read, get heartbeats, as often as workers must send them. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_HELD_H
#define COORDINATOR_PEERS_HELD_H

#include "coordinator/peers/session.h"

enum { HELD_REQUESTS_MS = 50 /* of TICK_MS */ };

/* true: the request waits and the envelope is taken; or too much is waiting, and the peer was told so. */
bool held_take(struct session *p, struct envelope *env);
void held_tick(struct session *p);
void held_drop(struct session *p); /* the peer is gone */
/* Takes the first waiting request, which the caller then owns; false: there is none. */
bool held_next(struct session *p, struct envelope *env);
/* The session whose first request is next; NULL: none waits, or none may be handled before the next tick. */
struct session *held_turn(const struct peers *s);
/* After a message whose handling began then (jobs_now): what requests of clients take counts. */
void held_end(struct session *p, Farm__Envelope__BodyCase what, double begun);

#endif
