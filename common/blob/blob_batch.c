/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The files have temporary names until all of them are flushed; then they are renamed, and the folder is flushed. If
 * this fails midway, the files that have been renamed stay: the next start lists them, and they are checked before use.
 */
#include "common/blob/blob_batch.h"

#include "common/base/disk.h"
#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/blob/blob_state.h"

#include <stdatomic.h>

enum { PATH_SIZE = 4096 };

struct blob_batch {
	struct blob_store *store;
	struct list deferred;	  /* struct blob_deferred */
	size_t renamed_count;	  /* files that have got their names */
	atomic_bool is_cancelled; /* set by blob_batch_cancel */
};

struct blob_batch *blob_batch_new(struct blob_store *s)
{
	struct blob_batch *b = mem_alloc(1, sizeof *b);
	if (b)
		*b = (struct blob_batch){.store = s, .deferred.item_size = sizeof(struct blob_deferred)};
	return b;
}

static struct blob_deferred *deferred_at(const struct blob_batch *b, size_t i)
{
	return (struct blob_deferred *)b->deferred.items + i;
}

int blob_batch_add(struct blob_batch *b, struct blob_writer *w, struct error *e)
{
	struct blob_deferred *deferred = list_push(&b->deferred);
	if (!deferred) {
		blob_write_abort(w);
		return error_set(e, ENOMEM, "no memory for the list of blobs");
	}
	int rc = blob_write_defer(w, deferred, e);
	b->deferred.count -= rc != 0;
	return rc;
}

size_t blob_batch_count(const struct blob_batch *b)
{
	return b->deferred.count;
}

const struct blob_hash *blob_batch_hash(const struct blob_batch *b, size_t i)
{
	return &deferred_at(b, i)->hash;
}

static int flush_file(const char *path, struct error *e)
{
	int fd = disk_open(path, O_WRONLY | O_CLOEXEC | O_NOFOLLOW, 0);
	int rc = fd < 0 || disk_fsync(fd) ? error_file(e, errno, path) : 0;
	if (fd >= 0)
		disk_close(fd);
	return rc;
}

int blob_batch_flush(struct blob_batch *b, struct error *e)
{
	char from[PATH_SIZE], to[PATH_SIZE];
	int rc = 0;
	for (size_t i = 0; !rc && i < b->deferred.count; i++) {
		blob_temporary_path(b->store, deferred_at(b, i)->temp_number, from, sizeof from);
		rc = atomic_load(&b->is_cancelled) ? error_set(e, ECANCELED, "nobody waits for the files")
						   : flush_file(from, e);
	}
	for (; !rc && b->renamed_count < b->deferred.count; b->renamed_count += !rc) {
		const struct blob_deferred *k = deferred_at(b, b->renamed_count);
		blob_temporary_path(b->store, k->temp_number, from, sizeof from);
		blob_path(b->store, &k->hash, to, sizeof to);
		if (disk_rename(from, to))
			rc = error_file(e, errno, to);
	}
	return rc ? rc : disk_sync_folder(b->store->folder, e);
}

void blob_batch_cancel(struct blob_batch *b)
{
	atomic_store(&b->is_cancelled, true);
}

void blob_batch_commit(struct blob_batch *b)
{
	for (size_t i = 0; i < b->deferred.count; i++)
		blob_deferred_publish(b->store, deferred_at(b, i));
}

void blob_batch_discard(struct blob_batch *b)
{
	char path[PATH_SIZE];
	for (; b->renamed_count < b->deferred.count; b->renamed_count++) {
		blob_temporary_path(b->store, deferred_at(b, b->renamed_count)->temp_number, path, sizeof path);
		disk_unlink(path);
	}
}

void blob_batch_free(struct blob_batch *b)
{
	bool missing = false;
	if (!b)
		return;
	blob_batch_discard(b);
	for (size_t i = 0; i < b->deferred.count; i++)
		missing |= blob_deferred_release(b->store, deferred_at(b, i));
	if (missing)
		blob_store_sweep(b->store);
	list_fini(&b->deferred);
	mem_free(b);
}
