/* SPDX-License-Identifier: Apache-2.0 */
/* The leases that the worker holds, whatever state they are in. Loop's thread. */
#ifndef WORKER_DAEMON_LEASE_LIST_H
#define WORKER_DAEMON_LEASE_LIST_H

#include "worker/daemon/agent_state.h"

struct lease_task *lease_list_find(const struct agent *a,
				   const struct lease_key *k); /* NULL: it has none, or forgot it */
void lease_list_drop(struct agent *a, struct lease_task *l);
/* Nobody wants it any more. If a thread has it, it is dropped when the thread returns. */
void lease_list_forget(struct agent *a, struct lease_task *l);
/* All that wait for the scene fail with this error. */
void lease_list_fail(struct agent *a, struct job_cache *b, const struct error *e);

/* If leases are short and the coordinator's disk is slow, results pile up: no more leases are requested until they
 * have been acknowledged. */
void lease_list_limit_backlog(struct agent *a);
/* Far more than requested: no correct coordinator does that. */
bool lease_list_is_flood(const struct agent *a);
/* Many unacknowledged results are normal if leases are short and the coordinator's disk is slow. Disconnecting would
 * only send them all again. */
bool lease_list_is_stuffed(const struct agent *a);

#endif
