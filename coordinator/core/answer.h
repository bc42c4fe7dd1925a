/* SPDX-License-Identifier: Apache-2.0 */
/* Handles what workers send back. */
#ifndef COORDINATOR_CORE_ANSWER_H
#define COORDINATOR_CORE_ANSWER_H

#include "coordinator/core/event.h"
#include "coordinator/core/update.h"

struct farm;
struct job;

void answer_batch(struct farm *f, const struct event *ev);
void answer_stored(struct farm *f, const struct event *ev);
void answer_failed(struct farm *f, const struct event *ev);
void answer_delivered(struct farm *f, const struct event *ev);
void answer_returned(struct farm *f, const struct event *ev);
bool answer_all_failed(const struct farm *f,
		       const struct job *j); /* every worker present, since it last returned a result */

/* Whether a failure of this lease counts: its worker holds it, or was lost with it. */
bool answer_counts(const struct farm *f, uint64_t peer, const struct lease_key *k);

/* Whether a result of this lease that cannot be judged yet is worth keeping. Awaited: the worker holds the lease and
 * has not delivered it (EVENT_DELIVERED). Open: it may still be merged; the worker may have held the lease before it
 * reconnected. Useless: EVENT_BATCH would refuse it, whatever it contains. */
enum farm_delivery answer_awaits(const struct farm *f, uint64_t peer, const struct lease_key *k);

#endif
