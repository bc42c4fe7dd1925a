/* SPDX-License-Identifier: Apache-2.0 */
/* A worker comes and goes. */
#ifndef COORDINATOR_CORE_CONNECTION_H
#define COORDINATOR_CORE_CONNECTION_H

#include "coordinator/core/peer.h"

/* NULL with a sentence when it is refused. */
struct peer *connection_join(struct farm *f, const struct event_join *e, const char **refused);
void connection_leave(struct farm *f, struct peer *p);
/* The same of one that has gone by itself; its leases count as lost by it. */
void connection_lose(struct farm *f, struct peer *p);
void connection_lose_leases(struct farm *f, struct peer *p);
void connection_drop_leases(struct farm *f, struct peer *p, bool revoke);

/* The connections of an earlier run of the same home are closed. false with a sentence: this one is of an earlier
 * run. */
bool connection_replace(struct farm *f, const struct event_join *e, const char **refused);

#endif
