/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Requests that wait while the jobs of an earlier run are read (recovery.h), and are answered in order afterwards.
 * Hello, heartbeats and lists of jobs are answered at once. Peers that wait, also for the files of a submission to be
 * read, get heartbeats, as often as workers must send them. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_HELD_H
#define COORDINATOR_PEERS_HELD_H

#include "coordinator/peers/session.h"

/* true: the request waits and the envelope is taken; or too much is waiting, and the peer was told so. */
bool held_take(struct session *p, struct envelope *env);
void held_tick(struct session *p);
void held_drop(struct session *p); /* the peer is gone */
/* Takes the first waiting request, which the caller then owns; false: there is none. */
bool held_next(struct session *p, struct envelope *env);

#endif
