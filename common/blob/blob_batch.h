/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Blobs that are written one after the other and flushed together, by another thread: if each were flushed on its own,
 * with its folder, the event loop would do nothing else while a client sends thousands of small files. Until
 * blob_batch_commit none of the blobs exists, and after a crash their temporary files are removed. The store's thread,
 * except for blob_batch_flush and blob_batch_cancel.
 */
#ifndef COMMON_BLOB_BLOB_BATCH_H
#define COMMON_BLOB_BLOB_BATCH_H

#include "common/blob/blob.h"

struct blob_batch;

struct blob_batch *blob_batch_new(struct blob_store *s); /* NULL if memory is out */
/* Used instead of blob_write_commit: checks the hash and adds the blob to the batch. Frees the writer in any case.
 * Returns 0, -EBADMSG or -ENOMEM. */
int blob_batch_add(struct blob_batch *b, struct blob_writer *w, struct error *e);
size_t blob_batch_count(const struct blob_batch *b);
const struct blob_hash *blob_batch_hash(const struct blob_batch *b, size_t i);
/* Flushes and renames the files. Any thread, once; during the call only blob_batch_cancel may use the batch. */
int blob_batch_flush(struct blob_batch *b, struct error *e);
/* Makes a flush end with -ECANCELED after the current file, unless that is the last one. Any thread, at any time. */
void blob_batch_cancel(struct blob_batch *b);
/* Makes the blobs exist, after a flush without error. They are held until blob_batch_free. */
void blob_batch_commit(struct blob_batch *b);
/* Removes the temporary files of a batch that was not flushed, or not without error. */
void blob_batch_discard(struct blob_batch *b);
/* Frees the batch (NULL: does nothing). Removes the files that have not been renamed. */
void blob_batch_free(struct blob_batch *b);

#endif
