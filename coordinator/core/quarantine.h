/* SPDX-License-Identifier: Apache-2.0 */
/* Faults of workers, and their consequences for connections and answers. */
#ifndef COORDINATOR_CORE_QUARANTINE_H
#define COORDINATOR_CORE_QUARANTINE_H

#include "coordinator/core/event.h"

struct farm;
struct identity;
struct job;
struct peer;
struct slot;

/* Counts a wrong result; the text describes it in a few words. */
void quarantine_wrong(struct farm *f, struct identity *who, const char *what, const struct lease_key *k);

void quarantine_fault(struct farm *f, struct peer *p,
		      const char *text); /* it sent something that no correct worker sends */
/* The answer with this digest is right: workers that gave another one are reported, and the notes are cleared. */
void quarantine_settle(struct farm *f, struct job *j, struct slot *s, const struct batch_digest *right);

#endif
