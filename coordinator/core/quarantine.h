/* SPDX-License-Identifier: Apache-2.0 */
/* What a worker did wrong, and what follows from it for its connections and its answers. */
#ifndef COORDINATOR_CORE_QUARANTINE_H
#define COORDINATOR_CORE_QUARANTINE_H

#include "coordinator/core/event.h"

struct farm;
struct identity;
struct job;
struct peer;
struct slot;

/* Counted as a wrong result; what it was in a few words. */
void quarantine_wrong(struct farm *f, struct identity *who, const char *what, const struct lease_key *k);
/* For good: no leases, nothing that it sends counts. */
void quarantine_worker(struct farm *f, struct identity *who);

void quarantine_fault(struct farm *f, struct peer *p, const char *text); /* it sent what no worker may send */
/* The answer with this digest is the right one: whoever gave another is reported, and nothing is noted any more. */
void quarantine_settle(struct farm *f, struct job *j, struct slot *s, const struct batch_digest *right);

#endif
