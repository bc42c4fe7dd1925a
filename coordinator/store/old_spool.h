/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads the files in which earlier versions kept what is now in the ledger (before version 4 of jobs.db): next-job,
 * clock and aside in the spool; and for each job its record (jobs/jN/job.json) and a copy of its row (jobs/jN/order).
 * The latter is a magic number and a message Row, with a checksum; in version 002 it is numbers, the sizes of texts
 * and frames, and then these, texts with their final 0. coordinator/jobs/import.h moves them into the ledger. One
 * thread.
 */
#ifndef COORDINATOR_STORE_OLD_SPOOL_H
#define COORDINATOR_STORE_OLD_SPOOL_H

#include "coordinator/store/ledger.h"
#include "coordinator/store/spool.h"

struct old_row {
	struct ledger_job job; /* a live job; old_spool_row_free frees what it points to */
	unsigned char *memory;
	struct ProtobufCMessage *message;
};

/* Reads a file of less than `max_size` bytes and adds a final 0; *text is mem_alloc'd. Returns -ENOENT if there is
 * none, -EFBIG if it is longer. */
int old_spool_read_text(const char *path, size_t max_size, char **text, size_t *size, struct error *e);
/* Reads the copy of a job's row. Returns -ENOENT if there is no file, -EBADMSG if it is damaged or another job's,
 * -EPROTO if it is of another version. */
int old_spool_read_row(const struct spool *s, uint64_t job, struct old_row *out, struct error *e);
void old_spool_row_free(struct old_row *f);

#endif
