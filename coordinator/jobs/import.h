/* SPDX-License-Identifier: Apache-2.0 */
/* Moves the files of earlier versions (store/old_spool.h) into the ledger. The loop's thread. */
#ifndef COORDINATOR_JOBS_IMPORT_H
#define COORDINATOR_JOBS_IMPORT_H

#include "coordinator/live_job/jobs.h"

/* Does nothing if the spool has no such files. Each file is deleted once the ledger has its contents, so an
 * interrupted import is continued by the next start. */
int import_files(struct jobs *jobs, struct error *e);

#endif
