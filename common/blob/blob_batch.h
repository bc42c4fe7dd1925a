/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Blobs that are written one after the other and flushed together, by another thread: two flushes for each would keep a
 * loop from everything else while somebody sends thousands of small files. Until blob_batch_enter none of them exists,
 * and after a crash their temporary files are removed. The store's thread, except for blob_batch_flush.
 */
#ifndef COMMON_BLOB_BLOB_BATCH_H
#define COMMON_BLOB_BLOB_BATCH_H

#include "common/blob/blob.h"

struct blob_batch;

struct blob_batch *blob_batch_new(struct blob_store *s); /* NULL: no memory */
/* Instead of blob_write_commit: checks the hash and adds the blob. Frees the writer in any case. -EBADMSG, -ENOMEM */
int blob_batch_add(struct blob_batch *b, struct blob_writer *w, struct error *e);
size_t blob_batch_count(const struct blob_batch *b);
const struct blob_hash *blob_batch_hash(const struct blob_batch *b, size_t i);
/* Flushes and renames the files. Any thread, once; nothing else but blob_batch_give_up may use the batch meanwhile. */
int blob_batch_flush(struct blob_batch *b, struct error *e);
/* Any thread, also during a flush, which ends with -ECANCELED after the current file, unless that is the last one. */
void blob_batch_give_up(struct blob_batch *b);
/* After a flush without error: from now on its blobs exist. They are held until blob_batch_free. */
void blob_batch_enter(struct blob_batch *b);
/* Removes the files of a batch that was not flushed, or not without error. As above. */
void blob_batch_discard(struct blob_batch *b);
void blob_batch_free(struct blob_batch *b); /* NULL: nothing. Removes what was not entered */

#endif
