/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chain states that a worker refuses to continue from. Neither the worker nor the maker of the states is blamed until a
 * second worker has judged them: the lease goes to a third worker if there is one.
 * - If the third continues, the refusal was wrong and counts as a wrong result.
 * - If it refuses, too, the states are wrong, which counts against their maker. The epoch that ends with them is taken
 *   back, including its sums, and computed again from the states before it, by another worker if possible: the job gets
 *   the bits it would have had.
 * - Without a third worker the same happens, and nobody is blamed.
 *
 * If the caller no longer has the earlier states, or an epoch was computed again AGAIN_MOST times and its states are
 * still refused, the chains start again from their seeds: that epoch depends on the plan alone, and earlier epochs stay
 * in the films. The job does not fail. All memory is in the slot; except for the maker of its states nothing survives a
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

/* The worker's lease has already been dropped. can: the caller can have the previous epoch computed again. */
void doubt_refused(struct farm *f, struct job *j, struct slot *s, const struct peer *p, bool can, const char *text);
bool doubt_bars(const struct farm *f, const struct job *j, const struct slot *s, const struct peer *p);
/* Call when a result of the slot's next epoch is merged, before job_merge: its sender accepted the states. */
void doubt_settle(struct farm *f, const struct job *j, struct slot *s, const struct identity *who,
		  const struct lease_key *k);
/* Who made the chain states that this lease begins with; "?": it is not the next lease of its group and part. */
const char *doubt_maker(const struct farm *f, const struct lease_key *k);
/* Why the job waits for another worker; false: it does not wait. */
bool doubt_why(const struct farm *f, const struct job *j, char *text, size_t size);

#endif
