/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Who workers are, for longer than their connections last: what a worker did wrong is not forgotten when it calls
 * again. A worker is known by the name in its certificate ("" without TLS) together with the name that it gives itself
 * or its home, the folder that counts its starts: who has one of the two in common with somebody is that somebody.
 * Bounded: those who have been away longest are forgotten first, of the newcomer's own certificate before others, and
 * those that are quarantined last; of these IDENTITY_QUARANTINED a certificate, so that one that makes up names pushes
 * out none but its own. Allocates when a worker joins.
 */
#ifndef COORDINATOR_CORE_WORKER_REGISTRY_H
#define COORDINATOR_CORE_WORKER_REGISTRY_H

#include "coordinator/core/event.h"
#include "coordinator/core/identity.h"
#include "coordinator/core/state.h"

/* As last reported when there is one like that, else a new one; used by the caller. NULL with a sentence:
 * refused. */
struct identity *worker_registry_use(struct farm *f, const struct event_join *e, const char **refused);
void worker_registry_drop(struct farm *f, struct identity *who);
void worker_registry_free(struct farm *f);

/* NULL: nobody by this home, or else this name. */
struct identity *worker_registry_find(const struct farm *f, const struct event_join *e);
/* Marks it; the rest is quarantine.h's. */
void worker_registry_set_aside(struct farm *f, struct identity *who);
/* As it was in an earlier run of the coordinator. */
void worker_registry_restore_quarantined(struct farm *f, const struct event_join *e, const char *text);

#endif
