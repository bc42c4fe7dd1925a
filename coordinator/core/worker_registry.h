/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Identities of workers, which outlive their connections, so that a worker's faults are not forgotten when it
 * reconnects. A worker is known by the name in its certificate ("" without TLS) together with its own name or its home,
 * the folder that counts its starts: whoever shares one of the two is the same worker. Bounded: those away longest are
 * forgotten first, of the newcomer's own certificate before others, and quarantined ones last; of these
 * IDENTITY_QUARANTINED are kept per certificate, so that inventing names displaces only one's own. Allocates when a
 * worker joins.
 */
#ifndef COORDINATOR_CORE_WORKER_REGISTRY_H
#define COORDINATOR_CORE_WORKER_REGISTRY_H

#include "coordinator/core/event.h"
#include "coordinator/core/identity.h"
#include "coordinator/core/state.h"

/* The existing entry, updated as reported, or a new one; referenced by the caller. NULL, with a sentence: refused. */
struct identity *worker_registry_use(struct farm *f, const struct event_join *e, const char **refused);
void worker_registry_drop(struct farm *f, struct identity *who);
/* The id of a worker that a result of an earlier run came from, which may be connected: what it reported itself stays.
 * Not a reference. 0: no room. */
uint64_t worker_registry_recall(struct farm *f, const struct event_join *e);
void worker_registry_free(struct farm *f);

/* NULL: no worker with this home or, failing that, this name. */
struct identity *worker_registry_find(const struct farm *f, const struct event_join *e);
/* Marks it; quarantine.h does the rest. */
void worker_registry_quarantine(struct farm *f, struct identity *who);
/* Restores one from an earlier run of the coordinator. */
void worker_registry_restore_quarantined(struct farm *f, const struct event_join *e, const char *text);

#endif
