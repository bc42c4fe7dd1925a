/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Identities of workers, which outlive their connections, so that a worker's faults are not forgotten when it
 * reconnects. A worker is identified by the name in its certificate ("" without TLS) together with either its own
 * name or its home, the folder that counts its starts: two connections that agree on the certificate and on one of
 * those are the same worker. The number of identities is bounded. Those away longest are forgotten first: those with
 * the newcomer's own certificate before others, quarantined ones last. At most IDENTITY_QUARANTINED_MAX quarantined
 * ones are kept per certificate, so inventing names displaces only entries of one's own certificate. Allocates when a
 * worker joins.
 */
#ifndef COORDINATOR_CORE_WORKER_REGISTRY_H
#define COORDINATOR_CORE_WORKER_REGISTRY_H

#include "coordinator/core/event.h"
#include "coordinator/core/identity.h"
#include "coordinator/core/state.h"

/* Returns the existing entry, updated from the event, or a new one, with a reference for the caller. Returns NULL and
 * sets *refusal to a sentence if there is no room. */
struct identity *worker_registry_acquire(struct farm *f, const struct event_join *e, const char **refusal);
/* Ends a reference. */
void worker_registry_release(struct farm *f, struct identity *identity);
/* Returns the id of a worker that made a stored result in an earlier run, adding it if it is not known; 0: no room.
 * Does not add a reference. What a worker has reported since it connected is not changed. */
uint64_t worker_registry_recall(struct farm *f, const struct event_join *e);
void worker_registry_free(struct farm *f);

/* Finds a worker by its home or, failing that, by its name; NULL: none. */
struct identity *worker_registry_find(const struct farm *f, const struct event_join *e);
/* Marks the worker; quarantine.h does the rest. */
void worker_registry_quarantine(struct farm *f, struct identity *identity);
/* Restores a worker that was quarantined in an earlier run of the coordinator. */
void worker_registry_restore(struct farm *f, const struct event_join *e, const char *text);

#endif
