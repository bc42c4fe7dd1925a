/* SPDX-License-Identifier: Apache-2.0 */
/* Counts faults and wrong results of workers, and quarantines those that reach max_faults. */
#ifndef COORDINATOR_CORE_QUARANTINE_H
#define COORDINATOR_CORE_QUARANTINE_H

#include "coordinator/core/event.h"

struct farm;
struct identity;
struct job;
struct peer;
struct slot;

/* Counts a wrong result. description: its first words, to which the lease is added. */
void quarantine_note_wrong_result(struct farm *f, struct identity *identity, const char *description,
				  const struct lease_key *k);

/* Counts a fault: the worker sent something that no correct worker sends. */
void quarantine_note_fault(struct farm *f, struct peer *p, const char *text);
/* The answer with the digest `correct` is right: workers that gave another one have given a wrong result. Clears the
 * slot's noted answers. */
void quarantine_judge_answers(struct farm *f, struct job *j, struct slot *s, const struct batch_digest *correct);

#endif
