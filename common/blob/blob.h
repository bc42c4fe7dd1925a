/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bytes named by their SHA-256: a folder of files, put there whole or not at all (temporary file, check, fsync,
 * rename, fsync of the folder).
 * A store with a limit forgets what was used least recently, but nothing that is held. One thread at a time for a
 * store; hashing functions from any thread. SHA-256 through OpenSSL's EVP.
 */
#ifndef COMMON_BLOB_BLOB_H
#define COMMON_BLOB_BLOB_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { BLOB_HASH_SIZE = 32, BLOB_HEX_SIZE = 65 };

struct blob_hash {
	uint8_t bytes[BLOB_HASH_SIZE];
};

int blob_hash_bytes(const void *bytes, size_t size, struct blob_hash *out, struct error *e);
void blob_hex(const struct blob_hash *h, char hex[BLOB_HEX_SIZE]);
bool blob_hash_equal(const struct blob_hash *a, const struct blob_hash *b);

struct blob_store;

/* Makes the folder if need be and clears temporary files of earlier lives. limit: bytes; 0: none. What is there stays
 * for now. */
int blob_store_open(struct blob_store **s, const char *folder, uint64_t limit, struct error *e);
void blob_store_close(struct blob_store *s);
/* When what is needed is held: what is beyond the limit goes. */
void blob_store_trim(struct blob_store *s);

bool blob_has(struct blob_store *s, const struct blob_hash *h, uint64_t *size); /* size may be NULL */
/* Held blobs are not evicted; holds are counted. false: it is not there. */
bool blob_hold(struct blob_store *s, const struct blob_hash *h);
void blob_release(struct blob_store *s, const struct blob_hash *h);

/* Whether the file's bytes are still those of its name, read anew unless that was done in the last so many seconds, or
 * (BLOB_SINCE_GIVEN) since it was opened last: a second a gigabyte. -EBADMSG: they are not, or the file is gone: it is
 * kept as damaged.NAME, and the store has the blob no more until it is written again; holds stay. -ENOENT: the store
 * has it not. Else the file cannot be read just now. */
enum { BLOB_SINCE_GIVEN = -1 };
int blob_check(struct blob_store *s, const struct blob_hash *h, double seconds, struct error *e);
/* Holds a blob that is there or is not: when it is written again it is held. -ENOMEM */
int blob_expect(struct blob_store *s, const struct blob_hash *h, struct error *e);

/* A file descriptor to read from, or -ENOENT. The caller closes it. */
int blob_open(struct blob_store *s, const struct blob_hash *h, uint64_t *size, struct error *e);

/* The file of a blob that is held, for those who map it. */
void blob_path(const struct blob_store *s, const struct blob_hash *h, char *path, size_t size);

/* Writing: begin, add in order, commit. What is announced has its room from the beginning on. -EFBIG: more than was
 * announced or than the limit; -EBADMSG: the bytes are not those of that name. A writer ends with commit or abort. What
 * is committed is held once. */
struct blob_writer;
int blob_write_begin(struct blob_writer **w, struct blob_store *s, const struct blob_hash *h, uint64_t size,
		     struct error *e);
uint64_t blob_write_at(const struct blob_writer *w); /* bytes so far */
int blob_write_add(struct blob_writer *w, const void *bytes, size_t size, struct error *e);
int blob_write_commit(struct blob_writer *w, struct error *e); /* frees the writer in any case */
void blob_write_abort(struct blob_writer *w);

#endif
