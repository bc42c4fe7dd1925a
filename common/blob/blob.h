/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Blobs named by their SHA-256: files in a folder, stored atomically (temporary file, check, fsync, rename, fsync of
 * the folder). A store with a limit evicts the blobs that were least recently used or released, but none that is held.
 * One thread at a time per store; the hashing functions from any thread. SHA-256 comes from OpenSSL's EVP.
 */
#ifndef COMMON_BLOB_BLOB_H
#define COMMON_BLOB_BLOB_H

#include "common/base/error.h"
#include "common/blob/blob_hash.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct blob_store;
struct blob_entry;

/* Creates the folder if necessary and removes temporary files of earlier runs. limit: bytes; 0: none. Existing blobs
 * are kept for now. */
int blob_store_open(struct blob_store **s, const char *folder, uint64_t limit, struct error *e);
void blob_store_close(struct blob_store *s);
/* Evicts the least recently used blob that is not held, to make room on the disk; false: there is none. */
bool blob_store_evict(struct blob_store *s);
/* Bytes of all files, including those that are held or still arriving. */
uint64_t blob_store_bytes(const struct blob_store *s);
/* Whoever may make room on the disk when nothing is left to evict; false: there is none. */
void blob_store_ask(struct blob_store *s, bool (*more_room)(void *user), void *user);
/* Call if files that are lost with the power can be fetched again. They are then not flushed to the disk: after a
 * restart no file is used before blob_check has read it. */
void blob_store_use_as_cache(struct blob_store *s);
/* Evicts what exceeds the limit, at most BLOB_TRIM_MOST at once. Call once everything needed is held, and again while
 * it returns true. */
enum { BLOB_TRIM_MOST = 64 /* a millisecond */ };
bool blob_store_trim(struct blob_store *s);

bool blob_has(struct blob_store *s, const struct blob_hash *h, uint64_t *size); /* size may be NULL */
/* Held blobs are not evicted; holds are counted. false: not in the store. */
bool blob_hold(struct blob_store *s, const struct blob_hash *h);
void blob_release(struct blob_store *s, const struct blob_hash *h);
bool blob_is_held(struct blob_store *s, const struct blob_hash *h); /* there or not */

/* Holds a blob, present or not: one that is written later is held from the start. -ENOMEM */
int blob_expect(struct blob_store *s, const struct blob_hash *h, struct error *e);

/* A file descriptor to read from, or -ENOENT. The caller closes it. */
int blob_open(struct blob_store *s, const struct blob_hash *h, uint64_t *size, struct error *e);

/* Its entry, there or not; NULL: none. For blob_check.c. */
struct blob_entry *blob_find(struct blob_store *s, const struct blob_hash *h);

/* The path of a held blob, for callers that map it. */
void blob_path(const struct blob_store *s, const struct blob_hash *h, char *path, size_t size);

/* Writing: begin, add in order, commit. Room is made as bytes arrive, so that whoever announces much and sends nothing
 * costs others nothing; begin looks whether the announced size fits beside the blobs that are held. -EFBIG: it does
 * not, or what was to be added does not fit now: nothing was, and the caller may try again. -EMSGSIZE: more than
 * announced, or announced more than the limit; -EBADMSG: the hash does not match the name. End a writer with commit or
 * abort. A committed blob is held once. */
struct blob_writer;
int blob_write_begin(struct blob_writer **w, struct blob_store *s, const struct blob_hash *h, uint64_t size,
		     struct error *e);
uint64_t blob_write_at(const struct blob_writer *w); /* bytes written so far */
void blob_write_pause(struct blob_writer *w);	     /* it has no descriptor until more is added */
int blob_write_add(struct blob_writer *w, const void *bytes, size_t size, struct error *e);
int blob_write_commit(struct blob_writer *w, struct error *e); /* frees the writer in any case */
void blob_write_abort(struct blob_writer *w);

/* For blob_batch.c: a file that is complete and checked, but neither flushed nor renamed. Its entry is held and counts
 * as missing, so that nothing is evicted under its name. Any thread may ask for paths. */
struct blob_kept {
	struct blob_hash hash;
	uint64_t size, number; /* number: of the temporary file */
};

void blob_temporary_path(const struct blob_store *s, uint64_t number, char *path, size_t size);
int blob_write_keep(struct blob_writer *w, struct blob_kept *kept, struct error *e); /* frees the writer in any case */
void blob_enter(struct blob_store *s, const struct blob_kept *kept); /* its file has its name and is flushed */
/* Once for each that was kept. true: it is missing and nobody holds it: sweep when all are let go. */
bool blob_let_go(struct blob_store *s, const struct blob_kept *kept);
void blob_store_sweep(struct blob_store *s); /* forgets those that are missing and not held, all in one pass */

#endif
