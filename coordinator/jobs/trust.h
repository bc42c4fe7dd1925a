/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Workers that gave wrong results: what is written down about them. Those that are quarantined stand in the spool's
 * file `aside`, so that they are after a restart, too; an operator lets one back by --forgive. A job's log and note say
 * how many results of such a worker are in its image that nobody had verified: they cannot be taken out again. Who gave
 * which is known as long as the coordinator runs. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_TRUST_H
#define COORDINATOR_JOBS_TRUST_H

#include "coordinator/job/jobs.h"

/* Tells the core who is quarantined, but for those that the configuration forgives. A file that
 * is damaged is put by as aside.damaged, and the log says so. */
int trust_open(struct jobs *jobs, struct error *e);

/* Of the job's leases that two workers compute: as it asks for, and no less than is asked of all; none of a mixed one.
 */
double trust_share(const struct jobs *jobs, const Farm__Submit *m);

void trust_merged(struct live_job *job, const struct action *a);
void trust_taken_back(struct live_job *job, uint64_t who); /* one of its results counts no more */
void trust_wrong(struct jobs *jobs, const struct action *a);
void trust_anew(struct jobs *jobs, const struct action *a); /* chains that lost their states */
void trust_quarantined(struct jobs *jobs, const struct action *a);

#endif
