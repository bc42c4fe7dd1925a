/* SPDX-License-Identifier: Apache-2.0 */
/* The leases that the worker holds, from the grant until the coordinator has acknowledged the result. Loop's thread. */
#ifndef WORKER_DAEMON_LEASE_LIST_H
#define WORKER_DAEMON_LEASE_LIST_H

#include "worker/daemon/agent_state.h"

/* NULL: there is none, or it was forgotten. */
struct lease_task *lease_list_find(const struct agent *a, const struct lease_key *k);
/* Frees it at once: no thread may have it. */
void lease_list_drop(struct agent *a, struct lease_task *l);
/* The same for one that nobody wants any more, also if a thread has it: then it is dropped when the thread returns. */
void lease_list_forget(struct agent *a, struct lease_task *l);
/* Tells the coordinator that all leases that wait for this scene have failed, with this error, and drops them. */
void lease_list_fail(struct agent *a, struct job_cache *b, const struct error *e);

/* Call when the number of results has changed. If leases are short and the coordinator's disk is slow, results pile up:
 * then no more leases are requested until enough results have been acknowledged. */
void lease_list_limit_backlog(struct agent *a);
/* Far more leases were granted than were requested: no correct coordinator does that. */
bool lease_list_is_flood(const struct agent *a);
/* So many results wait to be acknowledged that further grants are returned. Nobody is at fault, so the connection
 * stays: ending it would only send them all again. */
bool lease_list_is_stuffed(const struct agent *a);

#endif
