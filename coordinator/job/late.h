/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Results in a job's journal that cannot count yet, because one that comes before them was damaged (replay.h). They
 * stay where they are, and count as soon as that one has been computed again: nobody computes them a second time. The
 * loop's thread, but for what replay.h does with a live job that nobody else has.
 */
#ifndef COORDINATOR_JOB_LATE_H
#define COORDINATOR_JOB_LATE_H

#include "coordinator/job/live_job.h"

int late_add(struct live_job *job, const struct lease_key *k, uint64_t at, struct error *e); /* -ENOMEM */
/* Those of that (group, part) from this epoch on do not count any more. */
void late_forget(struct live_job *job, const struct lease_key *k);
void late_sort(struct live_job *job); /* as they can count */
void late_remove(struct live_job *job, size_t i);
/* The core gives a lease to this worker: true: its result is here and will count soon, the worker need not be told.
 */
bool late_withholds(struct live_job *job, const struct lease_key *k, uint64_t peer);

#endif
