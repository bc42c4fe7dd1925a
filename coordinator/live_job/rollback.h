/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The last batches of each (group, part), which may have to be taken back: where they are in the journal, and who made
 * the last one. If chain states are refused (coordinator/core/doubt.h), the batch that came with them cannot be
 * trusted: its sums are subtracted from the films, exactly, the earlier states become current again, and the journal
 * marks the batch that replaces it (JOURNAL_AGAIN), so that a restart does the same. Before that, a restart finds the
 * refused states again and asks again. A checkpoint starts a new journal, which gets the last two batches of each
 * (group, part) as far as they fit (JOURNAL_KEPT). If one is missing, nothing can be taken back. Nothing is kept for
 * samples. The loop's thread, or any thread that owns the live job. Memory: 24 bytes per batch of the journal.
 */
#ifndef COORDINATOR_LIVE_JOB_ROLLBACK_H
#define COORDINATOR_LIVE_JOB_ROLLBACK_H

#include "coordinator/live_job/live_job.h"

/* A merged batch, and the states before it (NULL: it started from seeds). */
struct rollback {
	struct batch batch;
	struct chain_state *states;
	struct live_job_maker maker; /* of those */
};

/* Records a merged batch, whose record in the journal starts there; if memory is out it cannot be taken back. maker
 * NULL: not known. */
void rollback_note(struct live_job *job, const struct lease_key *k, uint64_t at, const Farm__Maker *maker);
/* Reads the last batch of that lease's (group, part), whose epoch must be the one before k's. -ENOENT: its place is
 * not known. */
int rollback_read(const struct live_job *job, struct journal *j, const struct lease_key *k, struct rollback *b,
		  struct error *e);
/* Takes it out of the live job, which cannot fail. Its states become the live job's. */
void rollback_take(struct live_job *job, struct rollback *b);
void rollback_fini(struct rollback *b);

/* While replaying: a batch of that lease replaces one that was merged; the old one and all after it are dropped. */
int rollback_replay(struct live_job *job, struct journal *j, const struct lease_key *k, struct error *e);

/* Copies them into another journal, up to that many bytes. *list, of *count, gets their places there (mem_alloc'd).
 * What does not fit is left out. */
void rollback_copy(const struct live_job *job, struct journal *to, uint64_t most, struct merged_record **list,
		   size_t *count);

#endif
