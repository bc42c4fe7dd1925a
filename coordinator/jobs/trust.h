/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Records workers that gave wrong results. Quarantined workers are listed in a note of the ledger, so they stay
 * quarantined after a restart; an operator readmits one with --forgive. A job's log and note say how many unverified
 * results of such a worker are in its image; they cannot be taken out. Which worker made which result is known only
 * until the coordinator ends. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_TRUST_H
#define COORDINATOR_JOBS_TRUST_H

#include "coordinator/live_job/jobs.h"

/* Tells the core who is quarantined, except for workers that the configuration forgives. A damaged list is kept as
 * quarantined-damaged, and logged. */
int trust_open(struct jobs *jobs, struct error *e);

/* Returns the fraction of the job's leases to verify: what the job requests, but at least the minimum for all jobs; 0
 * for a mixed job. */
double trust_verify_fraction(const struct jobs *jobs, const Farm__Submit *m);

/* Counts a merged result of the worker that was not verified. */
void trust_count_unverified(struct live_job *job, const struct action *a);
/* One of its results does not count any more. */
void trust_discount_unverified(struct live_job *job, uint64_t worker_id);
/* Logs a wrong result in the job's log. */
void trust_log_wrong_result(struct jobs *jobs, const struct action *a);
/* chains start again from their seeds: logs and notes that in the job. */
void trust_note_chain_restart(struct jobs *jobs, const struct action *a);
/* Logs and stores that a worker is quarantined, and notes its unverified results in all live jobs. */
void trust_record_quarantine(struct jobs *jobs, const struct action *a);

#endif
