/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads what the coordinator kept in files of its spool before the ledger held everything (version 4 of jobs.db): the
 * spool's next-job, clock and aside; and of each job its record (jobs/jN/job.json) and a copy of its row
 * (jobs/jN/order, a magic number and a message Row, with a checksum; in version 002 numbers, the sizes of texts and
 * frames, then these, texts with their final 0). coordinator/jobs/import.h moves them. One
 * thread.
 */
#ifndef COORDINATOR_STORE_OLD_SPOOL_H
#define COORDINATOR_STORE_OLD_SPOOL_H

#include "coordinator/store/ledger.h"
#include "coordinator/store/spool.h"

struct old_row {
	struct ledger_job job; /* not ended; old_spool_row_free frees what it points to */
	unsigned char *memory;
	struct ProtobufCMessage *message;
};

/* A file of less than `most` bytes, with a 0 behind it; mem_alloc'd. -ENOENT, -EFBIG. */
int old_spool_text(const char *path, size_t most, char **text, size_t *size, struct error *e);
/* -ENOENT: no file; -EBADMSG: damaged, or another job's; -EPROTO: another version. */
int old_spool_row(const struct spool *s, uint64_t job, struct old_row *out, struct error *e);
void old_spool_row_free(struct old_row *f);

#endif
