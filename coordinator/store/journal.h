/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's journal: what was merged since its last checkpoint, one record after the other in jobs/jN/journal.G (G counts
 * the checkpoints). A record is believed when its checksum fits (journal_file.h). Those behind the last one that is
 * whole were not whole when the machine stopped, and are cut off; others that are not whole have been damaged since,
 * and are left out alone. What is appended waits in memory, up to 256 MB of all journals, until journal_sync writes it
 * and flushes it: after that it is durable. So whoever appends does not wait for a disk that is busy. A file of which a
 * call failed is bad: it is neither written nor flushed again, because a flush that failed may have forgotten what it
 * did not write and would say next time that all is well. What is appended from then on stays in memory until
 * journal_renew has brought all into a new file. (Who reads a journal believes what is read: the machine that failed to
 * write it has forgotten that with its process.) One thread at a time, but journal_sync may run beside the others: the
 * handle is counted, so that a flush outlives a close.
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
	JOURNAL_BATCH = 1,	/* a frame as it came: prefix, header, payload */
	JOURNAL_PINNED = 2,	/* the fingerprint that the job belongs to */
	JOURNAL_OLD_LOOK = 3,	/* as earlier versions stored it: a struct as it lay in memory */
	JOURNAL_OLD_COUNTS = 4, /* the same */
	JOURNAL_AGAIN = 5,	/* as JOURNAL_BATCH, in the place of the last one of that lease, which is taken back
				   with all of its (group, part) after it */
	JOURNAL_KEPT = 6,   /* as JOURNAL_BATCH: merged before the checkpoint, and kept because it may be taken back */
	JOURNAL_LOOK = 7,   /* a message Look of proto/stored.proto */
	JOURNAL_COUNTS = 8, /* Counts: in all, not since the last */
};

struct journal;

/* A new one, durable with its name before it returns. The folder exists. */
int journal_create(struct journal **j, const char *folder, uint64_t job, uint64_t generation, struct error *e);

/* A record, or a place where some are missing. */
struct journal_item {
	struct journal *journal; /* for journal_body of those before it */
	enum journal_kind kind;
	double elapsed;		/* as both were given to journal_append */
	struct lease_key lease; /* .kind 0: none */
	const unsigned char *body;
	size_t size;
	uint64_t at;	  /* of the record in the file: journal_body */
	uint64_t missing; /* 0: it is a record. Else so many are damaged: one, of which kind, elapsed and lease are
			     known, or any of which nothing is (.kind 0) */
};
/* Not 0: the reading stops with this code. */
typedef int journal_visit(void *user, const struct journal_item *item, struct error *e);

struct journal_found {
	uint64_t cut;	  /* bytes at the end that were not whole */
	uint64_t damaged; /* records in the middle that are not */
	uint64_t lost;	  /* of these: were durable once. The others perhaps never were */
};

/* Visits what is whole, cuts off what is not at the end, goes on behind it. -ENOENT: there is none; -EBADMSG: that of
 * another job or generation; -EPROTO: of another version. Whatever the error, also one of reading: the file is as it
 * was. */
int journal_open(struct journal **j, const char *folder, uint64_t job, uint64_t generation, journal_visit *visit,
		 void *user, struct journal_found *found, struct error *e);
/* The body of a record that was visited, again; mem_alloc'd. The loop's thread, or whoever has the journal alone.
 * -EBADMSG: it is damaged by now. */
int journal_body(struct journal *j, uint64_t at, unsigned char **body, size_t *size, struct error *e);
void journal_hold(struct journal *j);
void journal_release(struct journal *j); /* NULL: nothing */

/* Room on the disk for a record with a body of so many bytes, so that appending it does not fail for want of it.
 * -ENOSPC */
int journal_reserve(struct journal *j, size_t body, struct error *e);
/* lease: NULL: none. The body is a, copied, and b (NULL: nothing), taken if this succeeds. -ENOMEM, -EFBIG; and what is
 * not of the result (looks, counts) is not taken when the disk has no room for it: -ENOSPC. A journal that is bad takes
 * all. */
int journal_append(struct journal *j, enum journal_kind kind, const struct lease_key *lease, double elapsed,
		   const void *a, size_t a_size, struct buf *b, struct error *e);
uint64_t journal_bytes(struct journal *j); /* all that was appended, or read */
uint64_t journal_generation(const struct journal *j);
/* All that was appended before the call is in the file when it returns; for whoever opens it. The machine may still
 * lose it. */
int journal_write(struct journal *j, struct error *e);
/* All that was appended before the call is durable when it returns; costs nothing when it was already. Any thread, one
 * at a time. */
int journal_sync(struct journal *j, struct error *e);

/* All of a journal into a new file, flushed, in the place of the old one; then it is a good one, and what other handles
 * of the old file do or did is nothing to it. -EAGAIN: a flush is still under way. */
bool journal_is_bad(const struct journal *j);
int journal_renew(struct journal *j, struct error *e);
/* Its file is no longer where it was: it is bad from now on. What is in it can still be read, and brought into a new
 * one. */
bool journal_is_gone(const struct journal *j);
void journal_distrust(struct journal *j);
/* All that was appended is safe elsewhere: journal_sync has nothing more to do, and does not fail. */
void journal_settle(struct journal *j);

#endif
