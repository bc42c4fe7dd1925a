/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's row of the ledger once more, in the job's own folder (jobs/jN/order): what the database has lost is made anew
 * from it. Written whenever the row has been, and after it, so that its revision is never above the row's unless the
 * database went back. Any thread, one at a time for a job.
 */
#ifndef COORDINATOR_STORE_ROW_FILE_H
#define COORDINATOR_STORE_ROW_FILE_H

#include "coordinator/store/ledger.h"
#include "coordinator/store/spool.h"

struct row_file {
	struct ledger_job job; /* not ended; what it points at is freed by row_file_free */
	unsigned char *memory;
	struct ProtobufCMessage *message;
};

int row_file_write(const struct spool *s, const struct ledger_job *j, struct error *e);
/* -ENOENT: there is none; -EBADMSG: it is damaged, or another job's; -EPROTO: of another version. */
int row_file_read(const struct spool *s, uint64_t job, struct row_file *out, struct error *e);
void row_file_free(struct row_file *f);

#endif
