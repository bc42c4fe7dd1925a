/* SPDX-License-Identifier: Apache-2.0 */
/*
 * At the start, before any job is read: the rows of the ledger against the jobs' own folders. What one of the two has
 * lost or damaged is made anew from the other (at level error: it should not have happened); so is the damaged record
 * of a job that has ended, as far as its row knows it. What neither knows is not
 * deleted: the start is refused, and says what is missing; with --accept-loss such folders are put into spool/lost,
 * each with a sentence, and the rest goes on.
 */
#ifndef COORDINATOR_JOBS_RECONCILE_H
#define COORDINATOR_JOBS_RECONCILE_H

#include "coordinator/job/jobs.h"

/* Opens the ledger. -EBADMSG: something is lost. */
int reconcile(struct jobs *jobs, struct error *e);
/* The row has been written: so is its copy. What the disk does not take is said, and written at the next start. */
void reconcile_row(struct jobs *jobs, uint64_t job);

#endif
