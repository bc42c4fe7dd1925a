/* SPDX-License-Identifier: Apache-2.0 */
/* Handles the answers of workers to leases. Each function takes one kind of event (event.h). */
#ifndef COORDINATOR_CORE_ANSWER_H
#define COORDINATOR_CORE_ANSWER_H

#include "coordinator/core/event.h"
#include "coordinator/core/update.h"

struct farm;
struct job;

void answer_batch(struct farm *f, const struct event *ev);
void answer_stored_batch(struct farm *f, const struct event *ev);
void answer_lease_failed(struct farm *f, const struct event *ev);
void answer_batch_delivered(struct farm *f, const struct event *ev);
void answer_lease_returned(struct farm *f, const struct event *ev);
/* Whether every connected worker that the job accepts has failed with it since it last returned a result. */
bool answer_have_all_workers_failed(const struct farm *f, const struct job *j);

/* Whether a failure of this lease counts: the worker holds the lease, or was lost while it held it. */
bool answer_failure_counts(const struct farm *f, uint64_t peer, const struct lease_key *k);

/* Says whether a result of this lease that cannot be judged yet is worth keeping. AWAITED: the worker holds the lease
 * and has not delivered it (EVENT_BATCH_DELIVERED). OPEN: it may still be merged, for instance because the worker held
 * the lease before it reconnected. USELESS: EVENT_BATCH would refuse it, whatever it contains. */
enum farm_delivery answer_judge_delivery(const struct farm *f, uint64_t peer, const struct lease_key *k);

#endif
