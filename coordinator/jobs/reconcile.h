/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Opens the ledger at the start, and compares it with the jobs' folders. What is lost is not deleted: the start is
 * refused, and says what is missing. With --accept-loss such folders are moved to spool/lost, each with an explanation,
 * and the rest continues.
 */
#ifndef COORDINATOR_JOBS_RECONCILE_H
#define COORDINATOR_JOBS_RECONCILE_H

#include "coordinator/live_job/jobs.h"

int reconcile(struct jobs *jobs, struct error *e); /* -EBADMSG: something is lost */

#endif
