/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Opens the ledger at the start, and compares it with the jobs' folders. If something is lost, nothing is deleted:
 * the start is refused, with a list of what is missing. With --accept-loss the folders of lost jobs are moved to
 * spool/lost, each with an explanation, and the other jobs continue.
 */
#ifndef COORDINATOR_JOBS_RECONCILE_H
#define COORDINATOR_JOBS_RECONCILE_H

#include "coordinator/live_job/jobs.h"

int reconcile_spool(struct jobs *jobs, struct error *e); /* -EBADMSG: something is lost */

#endif
