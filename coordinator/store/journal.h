/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's journal: the results merged since its last checkpoint, record by record, in jobs/jN/journal.G (G counts the
 * checkpoints). A record is valid if its checksum matches (journal_file.h). Invalid records after the last valid one
 * were incomplete when the machine stopped, and are cut off; other invalid records have been damaged since, and only
 * they are skipped.
 *
 * Appended records wait in memory, up to 256 MB for all journals, until journal_sync writes and flushes them; only
 * then are they durable. So appending does not wait for a busy disk.
 *
 * After a failed operation a file is bad: it is neither written nor flushed again, because a failed flush may have
 * dropped data, and the next one would report success. Records appended to a bad journal stay in memory until
 * journal_renew has copied everything into a new file. (After a restart, what is read from the file can be trusted:
 * the dropped pages are no longer in the cache.) One thread at a time, except that journal_sync may run beside the
 * other functions. The handle is reference-counted, so a flush outlives a close.
 */
#ifndef COORDINATOR_STORE_JOURNAL_H
#define COORDINATOR_STORE_JOURNAL_H

#include "common/base/buf.h"
#include "common/base/error.h"
#include "common/film/batch.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum journal_kind {
	JOURNAL_BATCH = 1,	 /* a frame as received: prefix, header, payload */
	JOURNAL_FINGERPRINT = 2, /* the fingerprint that the job is pinned to */
	JOURNAL_OLD_LOOK = 3,	 /* an estimate, by earlier versions (coordinator/live_job/stored.h) */
	JOURNAL_OLD_COUNTS = 4,	 /* totals, by earlier versions */
	/* Like JOURNAL_BATCH, but replaces the last record of the same lease, which is taken back together with all
	 * later records of its (group, part). */
	JOURNAL_BATCH_REPLACEMENT = 5,
	/* Like JOURNAL_BATCH, but merged before the checkpoint; kept because it may have to be taken back. */
	JOURNAL_MERGED_BATCH = 6,
	JOURNAL_LOOK = 7,   /* a message Look of proto/stored.proto */
	JOURNAL_COUNTS = 8, /* totals of the job's counters, not increments */
};

struct journal;

/* Creates a new journal. File and name are durable when this returns. The folder must exist. */
int journal_create(struct journal **out, const char *folder, uint64_t job, uint64_t generation, struct error *e);

/* A record, or a place where records are missing. */
struct journal_item {
	struct journal *journal; /* for journal_read_body, which can read this record and earlier ones */
	enum journal_kind kind;
	double elapsed;		/* as passed to journal_append */
	struct lease_key lease; /* its kind is 0 for a record that belongs to no lease */
	const unsigned char *body;
	size_t body_size;
	uint64_t offset; /* offset of the record, for journal_read_body */
	/* 0: this is a valid record. Otherwise the number of damaged records: either one whose kind, elapsed and
	 * lease are known, or several of which nothing is known (their kind is 0). */
	uint64_t damaged_count;
};
/* Called for each item in order. A result other than 0 stops the reading with that code. */
typedef int journal_visitor(void *user, const struct journal_item *item, struct error *e);

struct journal_damage {
	uint64_t cut_bytes;	/* of incomplete records at the end */
	uint64_t damaged_count; /* records in the middle */
	/* number of these records that had been durable; the others may never have been complete */
	uint64_t lost_count;
};

/* Opens an existing journal: visits its valid records, cuts off incomplete ones at the end, and appends behind them.
 * Returns -ENOENT if there is no file; -EBADMSG if it belongs to another job or generation; -EPROTO if it is of
 * another version. After any error, including a read error, the file is unchanged. */
int journal_open(struct journal **out, const char *folder, uint64_t job, uint64_t generation, journal_visitor *visit,
		 void *user, struct journal_damage *damage, struct error *e);
/* Reads the body of a visited record again; *body is mem_alloc'd. Returns -EBADMSG if it has been damaged since. The
 * loop's thread, or any thread that owns the journal. */
int journal_read_body(struct journal *j, uint64_t offset, unsigned char **body, size_t *size, struct error *e);
/* Adds a reference. */
void journal_hold(struct journal *j);
void journal_release(struct journal *j); /* ends a reference; j may be NULL */

/* Reserves disk space for a record with a body of this size, so that appending it cannot fail for lack of space.
 * Returns -ENOSPC if the disk is full; -EIO if the journal is bad, since freeing space would not help: the sentence
 * says what made it bad. */
int journal_reserve(struct journal *j, size_t body, struct error *e);
/* Appends a record. lease: NULL: it belongs to none. The body is a copy of `copied`, followed by `owned` (may be
 * NULL), which is taken over on success. Returns -ENOMEM, or -EFBIG if the body is too large. Records that are neither
 * results nor fingerprints (estimates, counters) are refused with -ENOSPC if the disk is full. While the journal is
 * bad, records are not written but kept in memory for journal_renew, so the disk's space does not matter. */
int journal_append(struct journal *j, enum journal_kind kind, const struct lease_key *lease, double elapsed,
		   const void *copied, size_t copied_size, struct buf *owned, struct error *e);
uint64_t journal_bytes(struct journal *j); /* size of the file including queued records */
uint64_t journal_generation(const struct journal *j);
/* Writes the queued records, so that everything appended before the call can be read from the file. A crash may still
 * lose it. */
int journal_write(struct journal *j, struct error *e);
/* Writes and flushes the queued records: everything appended before the call is durable when it returns. Costs
 * nothing if it was already. If the journal is bad, returns the error that made it bad. Any thread, one at a time. */
int journal_sync(struct journal *j, struct error *e);

/* Whether an operation on the file has failed. */
bool journal_is_bad(const struct journal *j);
/* Copies the whole journal into a new file, flushes it, and lets it replace the old one. The journal is then good
 * again, whatever happens through other handles of the old file. Returns -EAGAIN while a flush is running. */
int journal_renew(struct journal *j, struct error *e);
/* Whether the file is no longer at its path. */
bool journal_file_is_missing(const struct journal *j);
/* Makes the journal bad because its file is gone. Its contents can still be read and copied into a new file. */
void journal_mark_bad(struct journal *j);
/* Declares that all its records are stored elsewhere: journal_sync has nothing left to do, and does not fail. */
void journal_mark_settled(struct journal *j);

#endif
