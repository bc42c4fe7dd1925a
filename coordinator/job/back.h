/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What was merged last of each (group, part) and may be taken back: where its batches lie in the journal, and who gave
 * the last one. Chain states that nobody can go on from (coordinator/core/doubt.h) say that the batch they came with is
 * not to be trusted: its sums are taken out of the films, exactly, the states before it are the last ones again, and
 * the journal says of the batch that comes in its place that it does (JOURNAL_AGAIN), so that a restart does the same.
 * Until then a restart finds the refused states again, and asks again. A checkpoint cuts the journal: the last two
 * batches of each (group, part) go into the next one as long as they have room (JOURNAL_KEPT). Where one is missing
 * nothing is taken back. Of samples nothing is noted. The loop's thread, or whoever has the live job alone. Memory: 24
 * bytes a batch of the journal.
 */
#ifndef COORDINATOR_JOB_BACK_H
#define COORDINATOR_JOB_BACK_H

#include "coordinator/job/live_job.h"

/* A batch as it was merged, and the states before it (NULL: it began with seeds). */
struct back {
	struct batch batch;
	struct chain_state *states;
	struct live_job_maker maker; /* of those */
};

/* The batch is merged, and its record begins there; without memory it cannot be taken back. maker NULL: not known. */
void back_note(struct live_job *job, const struct lease_key *k, uint64_t at, const Farm__Maker *maker);
/* Reads the last batch of that lease's (group, part). Its epoch must be the one before k's. -ENOENT: it is not known
 * where it lies. */
int back_read(const struct live_job *job, struct journal *j, const struct lease_key *k, struct back *b,
	      struct error *e);
/* Takes it out of the live job; that cannot fail. Its states go over to the live job. */
void back_take(struct live_job *job, struct back *b);
void back_fini(struct back *b);

/* A batch of that lease comes in the place of one that is merged, as the journal says: that one goes, and all after it.
 */
int back_replay(struct live_job *job, struct journal *j, const struct lease_key *k, struct error *e);

/* Into another journal, at most so many bytes; *list, of *count, says where they are there (mem_alloc'd). What does not
 * fit is left out. */
void back_copy(const struct live_job *job, struct journal *to, uint64_t most, struct merged_record **list,
	       size_t *count, size_t *capacity);

#endif
