/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Records workers that gave wrong results. Quarantined ones are listed in a note of the ledger, so they stay
 * quarantined after a restart; an operator readmits one with --forgive. A job's log and note say how many unverified
 * results of such a worker are in its image, where they cannot be taken out. Who made which result is known until the
 * coordinator ends. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_TRUST_H
#define COORDINATOR_JOBS_TRUST_H

#include "coordinator/live_job/jobs.h"

/* Tells the core who is quarantined, except for workers that the configuration forgives. A damaged list is kept as
 * quarantined-damaged, and the log says so. */
int trust_open(struct jobs *jobs, struct error *e);

/* Share of the job's leases to verify: what it requests, but at least the minimum for all jobs; none of a mixed job. */
double trust_share(const struct jobs *jobs, const Farm__Submit *m);

void trust_merged(struct live_job *job, const struct action *a);
void trust_taken_back(struct live_job *job, uint64_t who); /* one of its results does not count any more */
void trust_wrong(struct jobs *jobs, const struct action *a);
void trust_anew(struct jobs *jobs, const struct action *a); /* chains that lost their states */
void trust_quarantined(struct jobs *jobs, const struct action *a);

#endif
