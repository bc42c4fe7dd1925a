/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A journal as the bytes of a file (journal.h): a head, then records, each with a head and a body. A record's head
 * contains a mark, a checksum and a random number chosen by the journal (salt), which no peer knows. So the next
 * record can be found after damaged bytes, and no result that a worker makes up can pass for a record. Bodies have a
 * checksum of their own, so a record with a damaged body is still identified by its head. Heads have a fixed size, so
 * that space for a record can be reserved before it is written and damage can be searched for records. Any thread,
 * one at a time per scan.
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
 * The head of a record:
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

enum { JOURNAL_HEAD_SIZE = 40, JOURNAL_RECORD_HEAD_SIZE = 80 }; /* sizes of both heads in bytes */

struct journal_head {
	uint64_t job, generation, salt;
};

struct journal_record { /* head of a record */
	uint32_t body_size, body_crc;
	uint32_t kind;		       /* enum journal_kind (journal.h) */
	uint64_t number;	       /* number of the record in its file, from 0 */
	uint64_t durable_count_before; /* number of records of the file that were durable when this one was written */
	double elapsed;
	/* Its kind is 0 if the record belongs to no lease; its job is not stored in the record. */
	struct lease_key lease;
	uint64_t salt;
};

/* Packs the head of a file. */
void journal_head_pack(const struct journal_head *h, unsigned char bytes[JOURNAL_HEAD_SIZE]);
/* Unpacks the head of a file. Returns -EPROTO if it is of another version, -EBADMSG if it is damaged or no head. */
int journal_head_unpack(const unsigned char bytes[JOURNAL_HEAD_SIZE], struct journal_head *h, const char *path,
			struct error *e);
/* Packs the head of a record whose body is a followed by b, and computes the checksums. */
void journal_record_pack(struct journal_record *r, unsigned char bytes[JOURNAL_RECORD_HEAD_SIZE], const struct buf *a,
			 const struct buf *b);

/* A stretch of a file, as found by a scan. */
struct journal_segment {
	enum {
		JOURNAL_SEGMENT_VALID,
		JOURNAL_SEGMENT_DAMAGED /* only the head is valid */,
		JOURNAL_SEGMENT_UNKNOWN /* no head is valid */
	} kind;
	/* Offsets of its first byte and of the byte after it; equal if UNKNOWN and records are only missing. */
	uint64_t begin, end;
	uint64_t record_count;	      /* number of records, according to the numbers in heads */
	struct journal_record record; /* not set for UNKNOWN */
	unsigned char *body;	      /* VALID: the body, mem_alloc'd */
};

struct journal_scan {
	int fd;
	uint64_t offset, end, salt, next_number; /* next_number: that of the record expected at `offset` */
	uint64_t durable_count;			 /* records that were durable, according to the last valid head */
	bool has_next;				 /* `next` holds the next valid record */
	struct journal_segment next;
};

/* Starts a scan of a file of `end` bytes at its first record. */
void journal_scan_begin(struct journal_scan *s, int fd, uint64_t end, uint64_t salt);
/* Finds the next piece. Returns 1; 0 if there is no valid record at or after s->offset; -errno or -ENOMEM, which say
 * nothing about the contents of the file. */
int journal_scan_next(struct journal_scan *s, struct journal_segment *p);
void journal_scan_end(struct journal_scan *s);
/* Reads the record at this offset. Returns 1 if it is valid (*body is mem_alloc'd), 0 if not, or -errno. */
int journal_read_record(int fd, uint64_t end, uint64_t salt, uint64_t offset, struct journal_record *r,
			unsigned char **body);
/* Finds the salt of a file whose head is damaged, from its first record. Returns -EBADMSG if that is damaged, too. */
int journal_scan_salt(int fd, uint64_t end, uint64_t *salt);

/* Gaps in the numbers of records, collected until it is known whether the missing records were durable. {NULL, 0} is
 * empty; free with mem_free(items). */
struct journal_gaps {
	struct journal_gap {
		uint64_t number, count;
	} * items;
	size_t count;
};
int journal_gaps_add(struct journal_gaps *g, uint64_t number, uint64_t count, struct error *e);
/* Counts the records missing in all gaps, and how many of them were durable. stored: number of records of the file
 * that were durable. */
void journal_gaps_count_records(const struct journal_gaps *g, uint64_t stored, uint64_t *damaged, uint64_t *lost);

/* Reads exactly `size` bytes. Returns -ENODATA if the file ends before that; other errors are I/O errors. */
int journal_read_at(int fd, void *bytes, size_t size, uint64_t offset);

/* Deletes the journals in the folder except that of generation `keep`; UINT64_MAX: all. If the folder cannot be
 * listed to its end, some may be left, and that is logged. */
void journal_delete_others(const char *folder, uint64_t keep);
/* Renames all journals in the folder to journal.G.damaged. Returns -errno if the folder could not be listed to its
 * end. */
int journal_rename_damaged(const char *folder, struct error *e);

#endif
