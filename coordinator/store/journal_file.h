/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A journal as bytes of a file (journal.h): a head, then records, each with a head of its own and a body. A record's
 * head has a mark, a checksum and a number that the journal drew (salt), which no peer knows: so the next record is
 * found wherever bytes before it are damaged, and no result that a worker made up can pass for a record. Bodies have a
 * checksum of their own: a damaged one is still known by its head. Heads are of a fixed size, so that room for a record
 * is asked for before it is written, and damage is searched for the next one; numbers are little endian, doubles as
 * their bits. Any thread, one at a time for a scan.
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
	uint64_t stored; /* so many records of the file were durable when this one was written */
	double elapsed;
	struct lease_key lease; /* .kind 0: it belongs to no lease; .job is the file's */
	uint64_t salt;
};

void journal_head_pack(const struct journal_head *h, unsigned char bytes[JOURNAL_HEAD]);
/* -EPROTO: of another version; -EBADMSG: none, or damaged. */
int journal_head_unpack(const unsigned char bytes[JOURNAL_HEAD], struct journal_head *h, const char *path,
			struct error *e);
/* The body is a, then b; the checksums are made here. */
void journal_record_pack(struct journal_record *r, unsigned char bytes[JOURNAL_RECORD], const struct buf *a,
			 const struct buf *b);

/* What comes next in a file. */
struct journal_piece {
	enum {
		JOURNAL_WHOLE,
		JOURNAL_DAMAGED /* its head is whole */,
		JOURNAL_UNKNOWN /* so are not even the heads */
	} what;
	uint64_t from, to;	      /* its bytes; UNKNOWN: perhaps none */
	uint64_t count;		      /* of records, by their numbers */
	struct journal_record record; /* but UNKNOWN */
	unsigned char *body;	      /* WHOLE: mem_alloc'd */
};

struct journal_scan {
	int fd;
	uint64_t at, end, salt, number; /* number: of the record that is expected there */
	uint64_t stored;		/* as the last whole record says */
	bool ahead;			/* the next whole one is known: */
	struct journal_piece found;
};

/* Reads a file of so many bytes from its first record on. */
void journal_scan_begin(struct journal_scan *s, int fd, uint64_t end, uint64_t salt);
/* 1; 0: from s->at on there is no whole record any more; -errno, -ENOMEM: nothing is said about the file. */
int journal_scan_next(struct journal_scan *s, struct journal_piece *p);
void journal_scan_end(struct journal_scan *s);
/* The one that begins there. 1: it is whole, its body is mem_alloc'd; 0: it is not. */
int journal_read_record(int fd, uint64_t end, uint64_t salt, uint64_t at, struct journal_record *r,
			unsigned char **body);
/* The salt of a file whose head is damaged, from its first record. -EBADMSG */
int journal_scan_salt(int fd, uint64_t end, uint64_t *salt);

/* Damaged records, until it is known whether they were durable. {NULL, 0, 0} is empty; mem_free(first). */
struct journal_gaps {
	struct journal_gap {
		uint64_t number, count;
	} * first;
	size_t count, capacity;
};
int journal_gaps_add(struct journal_gaps *g, uint64_t number, uint64_t count, struct error *e);
/* stored: so many records of the file were durable. */
void journal_gaps_count(const struct journal_gaps *g, uint64_t stored, uint64_t *damaged, uint64_t *lost);

/* All of it; -ENODATA: the file ends before that. What cannot be read is not what is not there. */
int journal_read_at(int fd, void *bytes, size_t size, uint64_t at);

/* journal.G's of the folder but that of `keep` go; UINT64_MAX: all. */
void journal_clear(const char *folder, uint64_t keep);
void journal_put_aside(const char *folder); /* all: they are called journal.G.damaged from now on */

#endif
