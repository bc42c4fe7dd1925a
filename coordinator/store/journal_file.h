/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A journal as bytes of a file (journal.h): a head, then records, each with a head and a body. A record's head has a
 * mark, a checksum and a random number chosen by the journal (salt), which no peer knows: so the next record is found
 * after damaged bytes, and no result that a worker makes up can pass for a record. Bodies have their own checksum, so a
 * damaged one is still identified by its head. Heads have a fixed size, so that room for a record can be reserved
 * before it is written and damage can be searched. Any thread, one at a time per scan.
 *
 * Numbers are little endian. The head of the file:
 *
 * offset  bytes  contents
 * 0       8      magic number and version, hsltJ002
 * 8       8      job
 * 16      8      generation: one more after each checkpoint
 * 24      8      salt, which its records repeat
 * 32      4      CRC-32C of bytes 0 to 31
 * 36      4      zero
 *
 * Of a record, before its body:
 *
 * 0       4      mark: f1 68 6a 0d
 * 4       4      size of the body
 * 8       4      CRC-32C of the body
 * 12      4      kind of record (enum journal_kind)
 * 16      8      number of the record in its journal
 * 24      8      number of records that were durable before it
 * 32      8      seconds since the first lease of the job, a double
 * 40      12     lease: kind, group, part
 * 52      4      zero
 * 56      8      lease: epoch
 * 64      8      salt of the journal
 * 72      4      zero
 * 76      4      CRC-32C of bytes 0 to 75
 */
#ifndef COORDINATOR_STORE_JOURNAL_FILE_H
#define COORDINATOR_STORE_JOURNAL_FILE_H

#include "common/base/buf.h"
#include "common/base/error.h"
#include "common/film/batch.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { JOURNAL_HEAD = 40, JOURNAL_RECORD = 80 }; /* bytes of each in a file */

struct journal_head {
	uint64_t job, generation, salt;
};

struct journal_record { /* before its body */
	uint32_t size, body_check;
	uint32_t kind;	 /* of enum journal_kind (journal.h) */
	uint64_t number; /* in its file, from 0 */
	uint64_t stored; /* this many records of the file were durable when this one was written */
	double elapsed;
	struct lease_key lease; /* .kind 0: it belongs to no lease; .job is the file's job */
	uint64_t salt;
};

void journal_head_pack(const struct journal_head *h, unsigned char bytes[JOURNAL_HEAD]);
/* -EPROTO: another version; -EBADMSG: not a head, or damaged. */
int journal_head_unpack(const unsigned char bytes[JOURNAL_HEAD], struct journal_head *h, const char *path,
			struct error *e);
/* The body is a followed by b; computes the checksums. */
void journal_record_pack(struct journal_record *r, unsigned char bytes[JOURNAL_RECORD], const struct buf *a,
			 const struct buf *b);

/* The next piece of a file. */
struct journal_piece {
	enum {
		JOURNAL_WHOLE,
		JOURNAL_DAMAGED /* only its head is valid */,
		JOURNAL_UNKNOWN /* not even heads are valid */
	} what;
	uint64_t from, to;	      /* number of bytes; UNKNOWN: perhaps none */
	uint64_t count;		      /* number of records, by the numbers in heads */
	struct journal_record record; /* except for UNKNOWN */
	unsigned char *body;	      /* WHOLE: mem_alloc'd */
};

struct journal_scan {
	int fd;
	uint64_t at, end, salt, number; /* number of the record that is expected there */
	uint64_t stored;		/* from the last valid record */
	bool ahead;			/* the next valid record is known: */
	struct journal_piece found;
};

/* Scans a file of this size from its first record on. */
void journal_scan_begin(struct journal_scan *s, int fd, uint64_t end, uint64_t salt);
/* 1; 0: no valid record from s->at on; -errno, -ENOMEM: nothing is said about the file. */
int journal_scan_next(struct journal_scan *s, struct journal_piece *p);
void journal_scan_end(struct journal_scan *s);
/* The record at this offset. 1: it is valid, its body is mem_alloc'd; 0: it is not. */
int journal_read_record(int fd, uint64_t end, uint64_t salt, uint64_t at, struct journal_record *r,
			unsigned char **body);
/* The salt of a file whose head is damaged, from its first record. -EBADMSG */
int journal_scan_salt(int fd, uint64_t end, uint64_t *salt);

/* Damaged records, until it is known whether they were durable. {NULL, 0} is empty; free with mem_free(first). */
struct journal_gaps {
	struct journal_gap {
		uint64_t number, count;
	} * first;
	size_t count;
};
int journal_gaps_add(struct journal_gaps *g, uint64_t number, uint64_t count, struct error *e);
/* stored: this many records of the file were durable. */
void journal_gaps_count(const struct journal_gaps *g, uint64_t stored, uint64_t *damaged, uint64_t *lost);

/* Reads all of it; -ENODATA: the file ends before that. Other errors are those of the disk. */
int journal_read_at(int fd, void *bytes, size_t size, uint64_t at);

/* Deletes the journal.G's of the folder, except for that of `keep`; UINT64_MAX: all. If the folder cannot be listed to
 * its end, some may be left, and that is logged. */
void journal_clear(const char *folder, uint64_t keep);
/* Renames all of them to journal.G.damaged. -errno: the folder could not be listed to its end. */
int journal_keep_damaged(const char *folder, struct error *e);

#endif
