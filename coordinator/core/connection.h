/* SPDX-License-Identifier: Apache-2.0 */
/* Workers join and leave. */
#ifndef COORDINATOR_CORE_CONNECTION_H
#define COORDINATOR_CORE_CONNECTION_H

#include "coordinator/core/peer.h"

/* NULL, with a sentence, if the worker is refused. */
struct peer *connection_join(struct farm *f, const struct event_join *e, const char **refused);
void connection_leave(struct farm *f, struct peer *p);
/* The same for a worker that has disappeared; its leases count as lost by it. */
void connection_lose(struct farm *f, struct peer *p);
void connection_lose_leases(struct farm *f, struct peer *p);
void connection_drop_leases(struct farm *f, struct peer *p, bool revoke);

/* Closes the connections of earlier runs of the same home. false, with a sentence: this connection is of an earlier
 * run. */
bool connection_replace(struct farm *f, const struct event_join *e, const char **refused);

#endif
