/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The last batches of each (group, part), which may have to be taken back: where they are in the journal, and who
 * made the last one. If chain states are refused (coordinator/core/doubt.h), the batch that came with them cannot be
 * trusted: its sums are subtracted from the films, exactly, the earlier states become current again, and the journal
 * marks the batch that replaces it (JOURNAL_BATCH_REPLACEMENT), so that a restart does the same. If the coordinator
 * restarts before the replacement is merged, it finds the refused states again, and they are refused again. A
 * checkpoint starts a new journal, into which the last two batches of each (group, part) are copied as far as they fit
 * (JOURNAL_MERGED_BATCH). If one of them is missing, nothing can be taken back. Only chains have states, so nothing is
 * kept for other plans. The loop's thread, or any thread that owns the live job. Memory: 24 bytes per batch of the
 * journal.
 */
#ifndef COORDINATOR_LIVE_JOB_ROLLBACK_H
#define COORDINATOR_LIVE_JOB_ROLLBACK_H

#include "coordinator/live_job/live_job.h"

/* A merged batch to be taken back, and the chain states before it (NULL: it started from seeds). */
struct rollback {
	struct batch batch;
	struct chain_state *states;
	struct live_job_maker maker; /* the worker that made `states` */
};

/* Notes that a batch was merged whose record is at `offset` in the journal. If out of memory it is not noted, and
 * cannot be taken back. maker NULL: not known. */
void rollback_note_batch(struct live_job *job, const struct lease_key *k, uint64_t offset, const Farm__Maker *maker);
/* Reads the last merged batch of the (group, part) of k, which must be the next lease. Returns -ENOENT if k is not,
 * or if the batch is not in the journal. */
int rollback_read(const struct live_job *job, struct journal *j, const struct lease_key *k, struct rollback *b,
		  struct error *e);
/* Takes the batch out of the live job, which cannot fail, and gives its states to the live job. */
void rollback_apply(struct live_job *job, struct rollback *b);
void rollback_fini(struct rollback *b);

/* Used when replaying a batch of lease k that replaces an earlier one: takes the old batch and all later ones of the
 * (group, part) back. */
int rollback_replay(struct live_job *job, struct journal *j, const struct lease_key *k, struct error *e);

/* Copies the last batches into another journal, at most `max_bytes` bytes; the others are left out. *list: their
 * offsets in the other journal, mem_alloc'd. */
void rollback_copy_records(const struct live_job *job, struct journal *to, uint64_t max_bytes,
			   struct merged_record **list, size_t *count);

#endif
