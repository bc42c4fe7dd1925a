/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Results in a job's journal that cannot be merged yet, because an earlier result was damaged (replay.h). They stay
 * in the journal and are merged as soon as the missing one has been computed again, so nothing else is computed
 * twice. The loop's thread; replay.h uses it on a live job that no other thread has.
 */
#ifndef COORDINATOR_LIVE_JOB_LATE_RESULTS_H
#define COORDINATOR_LIVE_JOB_LATE_RESULTS_H

#include "coordinator/live_job/live_job.h"

/* offset: in the journal. -ENOMEM. */
int late_results_add(struct live_job *job, const struct lease_key *k, uint64_t offset, struct error *e);
/* Drops the results of this (group, part) from this epoch on. */
void late_results_remove_from_epoch(struct live_job *job, const struct lease_key *k);
void late_results_sort(struct live_job *job); /* sorts them by the order in which they can be merged */
void late_results_remove(struct live_job *job, size_t i);
/* Call when the core gives a lease to this worker. Returns true if a stored result will be merged soon in place of a
 * new one, so the lease need not be sent. */
bool late_results_claim_lease(struct live_job *job, const struct lease_key *k, uint64_t peer);

#endif
