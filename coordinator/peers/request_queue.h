/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Requests that wait, and are answered in order afterwards. While the jobs of an earlier run are read (recovery.h),
 * all messages wait but hello, heartbeats and lists of jobs. At any time, the requests of clients wait once those
 * handled since the last tick have taken REQUESTS_MS_PER_TICK together, because the loop has other work to do; then
 * connections take turns. Peers that wait, also for the files of a submission to be read, are sent heartbeats, as
 * often as workers must send them. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_REQUEST_QUEUE_H
#define COORDINATOR_PEERS_REQUEST_QUEUE_H

#include "coordinator/peers/session.h"

enum { REQUESTS_MS_PER_TICK = 50 /* ms of each tick (TICK_MS) */ };

/* Returns true if the request has to wait, in which case the envelope is taken over, or if too many are waiting, in
 * which case the peer has been told so. */
bool request_queue_defer(struct session *p, struct envelope *env);
/* Sends a heartbeat to a peer that has been waiting for long enough. */
void request_queue_tick(struct session *p);
void request_queue_drop(struct session *p); /* drops all waiting requests; call when the peer is gone */
/* Takes the first waiting request, which then belongs to the caller. Returns false if there is none. */
bool request_queue_pop(struct session *p, struct envelope *env);
/* Returns the session whose first request is next; NULL if none waits, or none may be handled before the next tick. */
struct session *request_queue_next_session(const struct peers *s);
/* Call after a message whose handling began at `begun` (jobs_now): counts the time if it was a request of a client. */
void request_queue_note_handled(struct session *p, Farm__Envelope__BodyCase what, double begun);

#endif
