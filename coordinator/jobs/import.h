/* SPDX-License-Identifier: Apache-2.0 */
/* Moves what earlier coordinators kept in files of the spool (store/old_spool.h) into the ledger. The loop's thread. */
#ifndef COORDINATOR_JOBS_IMPORT_H
#define COORDINATOR_JOBS_IMPORT_H

#include "coordinator/live_job/jobs.h"

/* Does nothing in a spool that has no such files. Each file is deleted once the ledger has its contents, so that a
 * start that is interrupted goes on with the next one. */
int import_files(struct jobs *jobs, struct error *e);

#endif
