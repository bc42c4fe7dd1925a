/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chain states that a worker could not go on from. Who refuses them is not to blame, nor is who made them until a
 * second worker says the same: the lease goes to another worker, neither to the one nor to the other while there is a
 * third.
 *  - The third goes on: the refusal was wrong, and is counted as a wrong result.
 *  - The third refuses, too: the states are wrong, which is counted against who made them. The epoch that they are the
 * end of is taken back, sums and all, and computed again from the states before it, not by who made them while there is
 * another: the job has the bits that it would have had.
 *  - There is no third: the same, and nobody is to blame.
 * Where the caller no longer has what came before, or an epoch was computed again AGAIN_MOST times and its states are
 * refused still, the chains begin anew from their seeds: an epoch that depends on the plan alone, and what came before
 * it stays in the films. A job does not fail by it. Memory of a slot; but for who made its states nothing survives a
 * restart of the coordinator, which asks again.
 */
#ifndef COORDINATOR_CORE_DOUBT_H
#define COORDINATOR_CORE_DOUBT_H

#include "common/film/batch.h"

#include <stdbool.h>
#include <stddef.h>

struct farm;
struct identity;
struct job;
struct peer;
struct slot;

enum { AGAIN_MOST = 4 };

/* The lease of this worker is dropped already. can: the caller has what it takes to compute the epoch before again. */
void doubt_refused(struct farm *f, struct job *j, struct slot *s, const struct peer *p, bool can, const char *text);
bool doubt_bars(const struct farm *f, const struct job *j, const struct slot *s, const struct peer *p);
/* A result of the slot's next epoch is merged: its sender went on from the states. Before job_merge. */
void doubt_settle(struct farm *f, const struct job *j, struct slot *s, const struct identity *who,
		  const struct lease_key *k);
/* Who made the chain states that go with this lease; "?": it is not the next one of its group and part. */
const char *doubt_maker(const struct farm *f, const struct lease_key *k);
/* Why the job waits for another worker; false: it does not. */
bool doubt_why(const struct farm *f, const struct job *j, char *text, size_t size);

#endif
