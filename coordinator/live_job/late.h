/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Results in a job's journal that cannot count yet, because an earlier one was damaged (replay.h). They stay in the
 * journal and count as soon as that one has been computed again, so nothing is computed twice. The loop's thread;
 * replay.h uses it on a live job that nobody else has.
 */
#ifndef COORDINATOR_LIVE_JOB_LATE_H
#define COORDINATOR_LIVE_JOB_LATE_H

#include "coordinator/live_job/live_job.h"

int late_add(struct live_job *job, const struct lease_key *k, uint64_t at, struct error *e); /* -ENOMEM */
/* Drops those of that (group, part) from this epoch on. */
void late_forget(struct live_job *job, const struct lease_key *k);
void late_sort(struct live_job *job); /* in the order in which they can count */
void late_remove(struct live_job *job, size_t i);
/* Called when the core gives a lease to this worker. true: its result is stored and will count soon, so the worker
 * need not be told. */
bool late_withholds(struct live_job *job, const struct lease_key *k, uint64_t peer);

#endif
