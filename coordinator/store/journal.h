/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's journal: what was merged since its last checkpoint, record by record, in jobs/jN/journal.G (G counts the
 * checkpoints). A record is valid if its checksum matches (journal_file.h). Invalid records after the last valid one
 * were incomplete when the machine stopped, and are cut off; other invalid records have been damaged since, and only
 * they are skipped.
 *
 * Appended records wait in memory, up to 256 MB for all journals, until journal_sync writes and flushes them: only then
 * are they durable. So appending does not wait for a busy disk.
 *
 * After a failed operation a file is bad: it is neither written nor flushed again, because a failed flush may have
 * dropped data, and the next one would report success. What is appended from then on stays in memory until
 * journal_renew has copied everything into a new file. (A reader trusts what it reads: after a restart the dropped
 * pages are gone from the cache.) One thread at a time, except that journal_sync may run beside the others: the handle
 * is reference-counted, so a flush outlives a close.
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
	JOURNAL_BATCH = 1,	/* a frame as received: prefix, header, payload */
	JOURNAL_PINNED = 2,	/* the fingerprint that the job is pinned to */
	JOURNAL_OLD_LOOK = 3,	/* by earlier versions (coordinator/live_job/stored.h) */
	JOURNAL_OLD_COUNTS = 4, /* the same */
	JOURNAL_AGAIN = 5,  /* as JOURNAL_BATCH, but replaces the last one of that lease, which is taken back with all
			       later ones of its (group, part) */
	JOURNAL_KEPT = 6,   /* as JOURNAL_BATCH: merged before the checkpoint, kept because it may be taken back */
	JOURNAL_LOOK = 7,   /* a message Look of proto/stored.proto */
	JOURNAL_COUNTS = 8, /* totals, not increments */
};

struct journal;

/* Creates a new one, durable with its name when this returns. The folder must exist. */
int journal_create(struct journal **j, const char *folder, uint64_t job, uint64_t generation, struct error *e);

/* A record, or a place where some are missing. */
struct journal_item {
	struct journal *journal; /* for journal_body: records before it */
	enum journal_kind kind;
	double elapsed;		/* as passed to journal_append */
	struct lease_key lease; /* .kind 0: none */
	const unsigned char *body;
	size_t size;
	uint64_t at;	  /* offset of the record: for journal_body */
	uint64_t missing; /* 0: this is a record. Otherwise that many are damaged: one, whose kind, elapsed and lease
			     are known, or several of which nothing is known (.kind 0) */
};
/* A result other than 0 stops the reading with that code. */
typedef int journal_visit(void *user, const struct journal_item *item, struct error *e);

struct journal_found {
	uint64_t cut;	  /* bytes of incomplete records at the end */
	uint64_t damaged; /* damaged records in the middle */
	uint64_t lost;	  /* of these, records that were durable once. The others may never have been */
};

/* Visits valid records, cuts off incomplete ones at the end, appends behind. -ENOENT: no file; -EBADMSG: of another
 * job or generation; -EPROTO: of another version. After any error, also a read error, the file is unchanged. */
int journal_open(struct journal **j, const char *folder, uint64_t job, uint64_t generation, journal_visit *visit,
		 void *user, struct journal_found *found, struct error *e);
/* Reads the body of a visited record again; mem_alloc'd. The loop's thread, or any that owns the journal. -EBADMSG:
 * it is damaged by now. */
int journal_body(struct journal *j, uint64_t at, unsigned char **body, size_t *size, struct error *e);
void journal_hold(struct journal *j);
void journal_release(struct journal *j); /* j may be NULL */

/* Reserves room on the disk for a record with a body of this size, so that appending it cannot fail for lack of
 * space. -ENOSPC; -EIO if the journal is bad, since freeing space does not help: the sentence says what made it so. */
int journal_reserve(struct journal *j, size_t body, struct error *e);
/* lease: NULL: none. The body is a, copied, followed by b (may be NULL), taken on success. -ENOMEM, -EFBIG. Records
 * that are not results (estimates, counters) are refused if the disk has no room: -ENOSPC. A bad journal accepts
 * everything. */
int journal_append(struct journal *j, enum journal_kind kind, const struct lease_key *lease, double elapsed,
		   const void *a, size_t a_size, struct buf *b, struct error *e);
uint64_t journal_bytes(struct journal *j); /* bytes appended or read */
uint64_t journal_generation(const struct journal *j);
/* Everything appended before the call is in the file when it returns, for readers. A crash may still lose it. */
int journal_write(struct journal *j, struct error *e);
/* Everything appended before the call is durable when it returns; free of cost if it was already. If the journal is
 * bad, the error is the one that made it so. Any thread, one at a time. */
int journal_sync(struct journal *j, struct error *e);

/* Copies a whole journal into a new file, flushed, that replaces the old one. Then the journal is good, whatever
 * happens through other handles of the old file. -EAGAIN: a flush is running. */
bool journal_is_bad(const struct journal *j);
int journal_renew(struct journal *j, struct error *e);
/* The file is no longer at its path: the journal is bad from now on. Its contents can still be read and copied into
 * a new one. */
bool journal_is_gone(const struct journal *j);
void journal_distrust(struct journal *j);
/* Everything appended is stored safely elsewhere: journal_sync has nothing left to do, and does not fail. */
void journal_settle(struct journal *j);

#endif
