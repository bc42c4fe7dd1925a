/* SPDX-License-Identifier: Apache-2.0 */
/* The leases that the worker holds, from the grant until the coordinator has acknowledged the result. The loop's
 * thread. */
#ifndef WORKER_DAEMON_LEASE_LIST_H
#define WORKER_DAEMON_LEASE_LIST_H

#include "worker/daemon/agent_state.h"

/* Returns a lease; NULL if there is none, or if it has been forgotten. */
struct lease_task *lease_list_find(const struct agent *a, const struct lease_key *k);
/* Removes and frees a lease, which no thread may have. */
void lease_list_drop(struct agent *a, struct lease_task *l);
/* Drops a lease whose result is not wanted any more; if a thread has it, tells the thread to stop, and the lease is
 * dropped when the thread returns it. */
void lease_list_forget(struct agent *a, struct lease_task *l);
/* Returns all leases that wait for this scene as failed, with this error, and drops them. */
void lease_list_fail(struct agent *a, struct job_cache *cache, const struct error *e);

/* Call when the number of results has changed. If leases are short and the coordinator's disk is slow, results pile up:
 * then no more leases are requested until enough results have been acknowledged. */
void lease_list_update_backlog(struct agent *a);
/* Returns whether far more leases have been granted than were requested, which no correct coordinator does. */
bool lease_list_is_flooded(const struct agent *a);
/* Returns whether so many results wait to be acknowledged that further grants must be returned. The connection stays:
 * nobody is at fault, and on a new connection all results would be sent again. */
bool lease_list_is_full(const struct agent *a);

#endif
