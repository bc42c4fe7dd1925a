/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Compares the rows of the ledger with the jobs' folders at the start, before any job is read. What one of the two has
 * lost or damaged is restored from the other and logged at level error; so is the damaged record of an ended job, as
 * far as its row contains it. What is lost in both is not deleted: the start is refused, and says what is missing. With
 * --accept-loss such folders are moved to spool/lost, each with an explanation, and the rest continues.
 */
#ifndef COORDINATOR_JOBS_RECONCILE_H
#define COORDINATOR_JOBS_RECONCILE_H

#include "coordinator/job/jobs.h"

/* Opens the ledger. -EBADMSG: something is lost. */
int reconcile(struct jobs *jobs, struct error *e);
/* Call after the row was written: writes its copy. What the disk refuses is logged, and written at the next start. */
void reconcile_row(struct jobs *jobs, uint64_t job);

#endif
