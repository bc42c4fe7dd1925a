/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A copy of a job's row of the ledger, in the job's own folder (jobs/jN/order), from which a lost row is restored.
 * Written after each write of the row, so its revision is never above the row's unless the database went back in time.
 * Any thread, one at a time per job.
 */
#ifndef COORDINATOR_STORE_ROW_FILE_H
#define COORDINATOR_STORE_ROW_FILE_H

#include "coordinator/store/ledger.h"
#include "coordinator/store/spool.h"

struct row_file {
	struct ledger_job job; /* not ended; row_file_free frees what it points to */
	unsigned char *memory;
	struct ProtobufCMessage *message;
};

int row_file_write(const struct spool *s, const struct ledger_job *j, struct error *e);
/* -ENOENT: no file; -EBADMSG: damaged, or another job's; -EPROTO: another version. */
int row_file_read(const struct spool *s, uint64_t job, struct row_file *out, struct error *e);
void row_file_free(struct row_file *f);

#endif
