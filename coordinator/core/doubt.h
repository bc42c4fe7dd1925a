/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Settles who is right when a worker refuses to continue from the chain states of its lease. Neither the worker nor
 * the maker of the states is blamed until a second worker has judged the states: the lease goes to a third worker if
 * there is one.
 * - If the third worker continues, the refusal was wrong and counts as a wrong result.
 * - If the third worker refuses, too, the states are wrong, which counts against their maker. The epoch that ends
 *   with these states is taken back, including its sums, and computed again from the states before it, by another
 *   worker if possible. The job gets the bits it would have had.
 * - Without a third worker the epoch is taken back as well, and nobody is blamed.
 *
 * If the caller no longer has the earlier states, or an epoch was computed again DOUBT_ROLLBACKS_MAX times and its
 * states are still refused, the chains start again from their seeds: that epoch depends on the plan alone, and earlier
 * epochs stay in the films. The job does not fail. All this is stored in the slot. Only the maker of its states
 * survives a restart of the coordinator, which then asks again.
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

enum { DOUBT_ROLLBACKS_MAX = 4 };

/* Handles a refusal of chain states by p, whose lease has already been dropped. can_roll_back: the caller can take back
 * the previous epoch (its batch and the states before it are available). text: the worker's reason. */
void doubt_handle_refusal(struct farm *f, struct job *j, struct slot *s, const struct peer *p, bool can_roll_back,
			  const char *text);
/* Whether p may not get the slot's lease because it made or refused the states and another worker is available. */
bool doubt_bars_worker(const struct farm *f, const struct job *j, const struct slot *s, const struct peer *p);
/* Call when a result of the slot's next epoch is merged, before job_merge_epoch: the sender `identity` has accepted the
 * states. */
void doubt_settle(struct farm *f, const struct job *j, struct slot *s, const struct identity *identity,
		  const struct lease_key *k);
/* Returns the name of the worker that made the chain states this lease begins with; "?" if it is not the next lease
 * of its group and part. */
const char *doubt_maker_name(const struct farm *f, const struct lease_key *k);
/* Writes why the job waits for a worker to judge chain states. Returns false if it does not wait for that. */
bool doubt_describe_wait(const struct farm *f, const struct job *j, char *text, size_t size);

#endif
