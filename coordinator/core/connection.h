/* SPDX-License-Identifier: Apache-2.0 */
/* Connections of workers: joining, leaving, being lost. */
#ifndef COORDINATOR_CORE_CONNECTION_H
#define COORDINATOR_CORE_CONNECTION_H

#include "coordinator/core/peer.h"

/* Adds a worker. Returns NULL and sets *refusal to a sentence if the worker is refused. */
struct peer *connection_join(struct farm *f, const struct event_join *e, const char **refusal);
/* Removes a worker and returns its leases to the pool. */
void connection_leave(struct farm *f, struct peer *p);
/* Like connection_leave(), but for a worker that has disappeared: its leases count as lost by it. */
void connection_lose(struct farm *f, struct peer *p);
/* Returns the worker's leases to the pool and counts them as lost by it (lost_holders.h). */
void connection_lose_leases(struct farm *f, struct peer *p);
/* Returns the worker's leases to the pool. revoke: also tell the worker. */
void connection_drop_leases(struct farm *f, struct peer *p, bool revoke);

/* Closes the connections of earlier runs of the same home. Returns false and sets *refusal if the event itself
 * belongs to an earlier run. */
bool connection_supersede_earlier(struct farm *f, const struct event_join *e, const char **refusal);

#endif
