/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Blobs named by their SHA-256: files in a folder, stored atomically (temporary file, check, fsync, rename, fsync of
 * the folder). A store with a limit evicts the least recently used or released blobs, but none that is held. One thread
 * at a time per store; the hashing functions from any thread. SHA-256 comes from OpenSSL's EVP.
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

/* Opens a store: creates the folder if necessary, removes temporary files of earlier runs, and lists the blobs. limit:
 * most bytes of all blobs; 0: none. Blobs beyond the limit are not evicted yet. Returns 0, -ENOMEM, or -errno if the
 * folder or a file in it cannot be read. */
int blob_store_open(struct blob_store **out, const char *folder, uint64_t limit, struct error *e);
void blob_store_close(struct blob_store *s);
/* Evicts the least recently used blob that is not held, to make room on the disk; false if there is none. */
bool blob_store_evict(struct blob_store *s);
/* Returns the bytes of all files, including those that are held or still arriving. */
uint64_t blob_store_bytes(const struct blob_store *s);
/* Sets a function that is called when the disk is full and nothing is left to evict. It may make room elsewhere; it
 * returns false if it cannot. */
void blob_store_set_full_handler(struct blob_store *s, bool (*free_space)(void *user), void *user);
/* Call if files that are lost in a power failure can be fetched again. They are then not flushed to the disk, and after
 * a restart no file may be used before blob_check has read it. */
void blob_store_use_as_cache(struct blob_store *s);
/* Evicts blobs beyond the limit, at most BLOB_TRIM_MAX at once. Call it once everything needed is held, and again
 * while it returns true. */
enum { BLOB_TRIM_MAX = 64 /* takes about a millisecond */ };
bool blob_store_trim(struct blob_store *s);

/* Returns whether a blob is in the store, and its size, unless `size` is NULL. */
bool blob_is_stored(struct blob_store *s, const struct blob_hash *h, uint64_t *size);
/* Holds a blob, which is then not evicted until as many calls of blob_release. Returns false if it is not stored. */
bool blob_hold(struct blob_store *s, const struct blob_hash *h);
void blob_release(struct blob_store *s, const struct blob_hash *h);
bool blob_is_held(struct blob_store *s, const struct blob_hash *h); /* also true for a missing blob that is held */

/* Like blob_hold, but also for a blob that is not in the store, which is then held as soon as it is written. Returns 0
 * or -ENOMEM. */
int blob_hold_expected(struct blob_store *s, const struct blob_hash *h, struct error *e);

/* Returns a file descriptor to read from, which the caller closes, or -ENOENT. */
int blob_open(struct blob_store *s, const struct blob_hash *h, uint64_t *size, struct error *e);

/* For blob_check.c: returns the entry of a blob, present or missing; NULL if there is none. */
struct blob_entry *blob_find(struct blob_store *s, const struct blob_hash *h);

/* Returns the path of a held blob, for callers that map it. */
void blob_path(const struct blob_store *s, const struct blob_hash *h, char *path, size_t size);

/* Writing a blob: blob_write_begin, blob_write_append in order, blob_write_commit. Room is made as bytes arrive, so
 * that a peer that announces much and sends nothing costs others nothing; blob_write_begin only checks that the
 * announced size fits beside the blobs that are held. End each writer with commit or abort. A committed blob is held
 * once. Errors: -EFBIG if the announced size does not fit, or if the bytes to be added do not fit now (then none of
 * them is added, and the caller may try again); -EMSGSIZE for more bytes than announced, or an announced size above the
 * limit; -EBADMSG if the hash does not match the name; -errno of the disk. */
struct blob_writer;
int blob_write_begin(struct blob_writer **out, struct blob_store *s, const struct blob_hash *h, uint64_t size,
		     struct error *e);
uint64_t blob_write_offset(const struct blob_writer *w); /* bytes written so far */
void blob_write_pause(struct blob_writer *w);		 /* closes the file until more is added */
int blob_write_append(struct blob_writer *w, const void *bytes, size_t size, struct error *e);
int blob_write_commit(struct blob_writer *w, struct error *e); /* frees the writer in any case */
void blob_write_abort(struct blob_writer *w);

/* For blob_batch.c: a file that is complete and checked, but neither flushed nor renamed. Its entry is held and marked
 * as missing, so that nothing is evicted under its name. Paths may be asked for on any thread. */
struct blob_deferred {
	struct blob_hash hash;
	uint64_t size, temp_number; /* size of the blob; number of the temporary file */
};

void blob_temporary_path(const struct blob_store *s, uint64_t number, char *path, size_t size);
/* Ends a writer without flushing and renaming the file. Frees the writer in any case. */
int blob_write_defer(struct blob_writer *w, struct blob_deferred *deferred, struct error *e);
/* Marks the blob as present: its file has been flushed and renamed. */
void blob_deferred_publish(struct blob_store *s, const struct blob_deferred *deferred);
/* Ends the hold that blob_write_defer took; to be called once for each deferred file. Returns true if the blob is
 * missing and no longer held: then call blob_store_sweep after the last one. */
bool blob_deferred_release(struct blob_store *s, const struct blob_deferred *deferred);
/* Removes the entries of all blobs that are missing and not held, in one pass. */
void blob_store_sweep(struct blob_store *s);

#endif
