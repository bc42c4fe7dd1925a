/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A store is a sorted array of entries (hash, size, holds) that mirrors a folder: opening reads the folder, looking up
 * is a binary search, and the disk is only read for contents. The entry of an evicted blob stays in the array, marked
 * as missing, until a quarter of all entries are: one large file may evict thousands of a million small ones, and each
 * removal from the array would move the rest.
 *
 * Writing: blob_write_begin creates a temporary file; blob_write_append makes room, appends and hashes;
 * blob_write_commit compares the hash, flushes (unless the store is a cache), renames, and adds the entry. Until then
 * the blob does not exist. Instead of blob_write_commit, blob_write_defer leaves flushing and renaming to a batch; the
 * entry then exists at once, but is marked as missing until blob_deferred_publish.
 *
 * Failures: more bytes than announced are -EMSGSIZE, a wrong hash is -EBADMSG, and the temporary file is removed. A
 * full disk is -ENOSPC, once every blob that is not held has been evicted and the owner of the store has found no more
 * room. blob_check removes blobs whose file is missing or damaged.
 */
#include "common/blob/blob.h"

#include "common/base/clock.h"
#include "common/base/disk.h"
#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/blob/blob_state.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
	DISK_BLOCK_SIZE = 4096, /* bytes that even the smallest file takes on the disk */
	EVICTIONS_MIN = 8,	/* evictions at a time that are always allowed */
};

struct blob_writer {
	struct blob_store *store;
	struct blob_hash hash;
	uint64_t size, offset;	  /* bytes announced; bytes written so far */
	int fd;			  /* of the temporary file; -1: not open */
	bool is_created;	  /* the temporary file has been created */
	uint64_t temp_number;	  /* of the temporary file */
	char path[BLOB_PATH_MAX]; /* of the temporary file */
	EVP_MD_CTX *md;
};

/* ---- the store ---- */

static void file_path(const struct blob_store *s, const char *name, char path[BLOB_PATH_MAX])
{
	snprintf(path, BLOB_PATH_MAX, "%s/%s", s->folder, name);
}

/* Returns the index of the first entry whose hash is h or above; s->count if there is none. */
static size_t lower_bound(const struct blob_store *s, const struct blob_hash *h)
{
	size_t low = 0, high = s->count;
	while (low < high) {
		size_t mid = low + (high - low) / 2;
		if (memcmp(s->entries[mid]->hash.bytes, h->bytes, BLOB_HASH_SIZE) < 0)
			low = mid + 1;
		else
			high = mid;
	}
	return low;
}

struct blob_entry *blob_find(struct blob_store *s, const struct blob_hash *h)
{
	size_t i = lower_bound(s, h);
	return i < s->count && blob_hash_equal(&s->entries[i]->hash, h) ? s->entries[i] : NULL;
}

/* Like blob_find, but returns NULL also for an entry that is marked as missing. */
static struct blob_entry *find_present(struct blob_store *s, const struct blob_hash *h)
{
	struct blob_entry *n = blob_find(s, h);
	return n && !n->is_missing ? n : NULL;
}

static int reserve_entries(struct blob_store *s, size_t count, struct error *e)
{
	if (count <= s->capacity)
		return 0;
	size_t new_capacity = count > 2 * s->capacity ? count : 2 * s->capacity;
	struct blob_entry **grown = mem_grow(s->entries, s->capacity * sizeof *grown, new_capacity * sizeof *grown);
	if (!grown)
		return error_set(e, ENOMEM, "no memory for the list of blobs");
	s->entries = grown;
	s->capacity = new_capacity;
	return 0;
}

/* Inserts an entry, marked as missing, at index i. Returns NULL if memory is out. */
static struct blob_entry *add_entry(struct blob_store *s, size_t i, const struct blob_hash *h, struct error *e)
{
	struct blob_entry *n = reserve_entries(s, s->count + 1, e) ? NULL : mem_alloc(1, sizeof *n);
	if (!n) {
		error_set(e, ENOMEM, "no memory for the list of blobs");
		return NULL;
	}
	memmove(&s->entries[i + 1], &s->entries[i], (s->count++ - i) * sizeof *s->entries);
	s->entries[i] = n;
	*n = (struct blob_entry){.hash = *h, .is_missing = true};
	return n;
}

static int compare_hashes(const void *a, const void *b)
{
	const struct blob_entry *const *x = a, *const *y = b;
	return memcmp((*x)->hash.bytes, (*y)->hash.bytes, BLOB_HASH_SIZE);
}

/* A file found in the folder, and when it was last used. */
struct found_file {
	struct blob_hash hash;
	uint64_t size;
	struct timespec last_used;
};

static int compare_use_times(const void *a, const void *b)
{
	const struct found_file *x = a, *y = b;
	if (x->last_used.tv_sec != y->last_used.tv_sec)
		return x->last_used.tv_sec < y->last_used.tv_sec ? -1 : 1;
	return (x->last_used.tv_nsec > y->last_used.tv_nsec) - (x->last_used.tv_nsec < y->last_used.tv_nsec);
}

/* Reads the folder, oldest use first, so that the order of use survives a restart. */
static int read_folder(struct blob_store *s, struct error *e)
{
	struct found_file *files = NULL;
	size_t count = 0;
	int rc = 0;
	struct disk_list l;
	disk_list_begin(&l, s->folder);
	for (const char *name; !rc && (name = disk_list_next(&l));) {
		struct stat st;
		struct blob_hash h;
		char path[BLOB_PATH_MAX];
		file_path(s, name, path);
		if (strncmp(name, "tmp.", 4) == 0)
			disk_unlink(path);
		if (!blob_hash_from_hex(name, &h))
			continue;
		if (disk_stat(path, &st)) { /* fails the whole opening: the blob must not be taken for missing */
			rc = error_file(e, errno, path);
			break;
		}
		if (!S_ISREG(st.st_mode))
			continue;
		struct found_file *grown = list_grow_array(files, count, sizeof *files);
		if (!grown) {
			rc = error_set(e, ENOMEM, "%s: no memory for its list of files", s->folder);
			break;
		}
		files = grown;
		files[count++] = (struct found_file){h, (uint64_t)st.st_size, st.st_mtim};
	}
	rc = disk_list_end(&l, rc, e);
	if (count)
		qsort(files, count, sizeof *files, compare_use_times);
	if (!rc)
		rc = reserve_entries(s, count, e);
	for (size_t i = 0; !rc && i < count; i++) {
		struct blob_entry *n = add_entry(s, i, &files[i].hash, e);
		rc = n ? 0 : -ENOMEM;
		if (n) {
			s->bytes += n->size = files[i].size;
			n->is_missing = false;
			blob_idle_add(s, n);
		}
	}
	if (s->count)
		qsort(s->entries, s->count, sizeof *s->entries, compare_hashes);
	mem_free(files);
	return rc;
}

bool blob_store_evict(struct blob_store *s)
{
	struct blob_entry *oldest = TAILQ_FIRST(&s->idle);
	char path[BLOB_PATH_MAX];
	if (!oldest)
		return false;
	blob_path(s, &oldest->hash, path, sizeof path);
	disk_unlink(path);
	blob_idle_remove(s, oldest);
	s->bytes -= oldest->size;
	oldest->size = 0;
	oldest->is_missing = true;
	if (++s->evicted_count > s->count / 4)
		blob_store_sweep(s);
	return true;
}

static int refuse_excess(const struct blob_store *s, uint64_t need, struct error *e)
{
	return error_set(e, EFBIG, "%s: %llu more bytes exceed its limit of %llu, given what is in use", s->folder,
			 (unsigned long long)need, (unsigned long long)s->max_bytes);
}

/* Returns 0 if `need` more bytes would fit into the limit beside the blobs that are held. */
static int check_fits(const struct blob_store *s, uint64_t need, struct error *e)
{
	uint64_t used = s->bytes - s->idle_bytes;
	if (!s->max_bytes)
		return 0;
	if (need > s->max_bytes)
		return error_set(e, EMSGSIZE, "%s: a file of %llu bytes exceeds its limit of %llu", s->folder,
				 (unsigned long long)need, (unsigned long long)s->max_bytes);
	return used > s->max_bytes - need ? refuse_excess(s, need, e) : 0;
}

/* Evicts blobs until `need` more bytes fit into the limit, but no more files than take that much space on the disk,
 * where each takes at least a block. Otherwise, a megabyte could mean evicting tens of thousands of files of a few
 * bytes, which takes seconds. An excess over the limit is then evicted when the next bytes arrive. */
static int evict_for_limit(struct blob_store *s, uint64_t need, struct error *e)
{
	uint64_t max_evictions = need / DISK_BLOCK_SIZE + EVICTIONS_MIN;
	while (s->max_bytes && s->bytes + s->partial_bytes + need > s->max_bytes && max_evictions--)
		if (!blob_store_evict(s))
			return refuse_excess(s, need, e);
	return 0;
}

int blob_store_open(struct blob_store **out, const char *folder, uint64_t limit, struct error *e)
{
	struct blob_store *s = mem_alloc(1, sizeof *s);
	if (!s || !(s->folder = mem_strdup(folder))) {
		mem_free(s);
		return error_set(e, ENOMEM, "no memory for a blob store");
	}
	s->max_bytes = limit;
	TAILQ_INIT(&s->idle);
	int rc = strlen(folder) < BLOB_PATH_MAX - 2 * BLOB_HEX_SIZE
			 ? disk_make_folder(folder, e)
			 : error_set(e, ENAMETOOLONG, "%s: the name is too long", folder);
	if (!rc)
		rc = read_folder(s, e);
	if (rc)
		blob_store_close(s);
	else
		*out = s;
	return rc;
}

void blob_store_close(struct blob_store *s)
{
	if (!s)
		return;
	for (size_t i = 0; i < s->count; i++)
		mem_free(s->entries[i]);
	mem_free(s->entries);
	mem_free(s->folder);
	mem_free(s);
}

void blob_store_use_as_cache(struct blob_store *s)
{
	s->is_cache = true;
}

void blob_store_set_full_handler(struct blob_store *s, bool (*free_space)(void *user), void *user)
{
	s->free_space = free_space;
	s->user = user;
}

/* Makes room on a full disk; false if there is nothing left to remove. */
static bool free_disk_space(struct blob_store *s)
{
	return (s->max_bytes && blob_store_evict(s)) || (s->free_space && s->free_space(s->user));
}

bool blob_store_trim(struct blob_store *s)
{
	for (int i = 0; s->max_bytes && s->bytes + s->partial_bytes > s->max_bytes; i++)
		if (i == BLOB_TRIM_MAX)
			return true;
		else if (!blob_store_evict(s))
			break;
	return false;
}

uint64_t blob_store_bytes(const struct blob_store *s)
{
	return s->bytes + s->partial_bytes;
}

/* Marks a blob as the most recently used one, also on the disk for the next start. Returns NULL if it is missing. */
static struct blob_entry *touch_blob(struct blob_store *s, const struct blob_hash *h)
{
	struct blob_entry *n = find_present(s, h);
	if (!n)
		return NULL;
	char path[BLOB_PATH_MAX];
	blob_path(s, h, path, sizeof path);
	if (!n->hold_count) {
		blob_idle_remove(s, n);
		blob_idle_add(s, n);
	}
	if (s->max_bytes)
		disk_touch(path);
	return n;
}

bool blob_is_stored(struct blob_store *s, const struct blob_hash *h, uint64_t *size)
{
	struct blob_entry *n = find_present(s, h);
	if (n && size)
		*size = n->size;
	return n != NULL;
}

bool blob_hold(struct blob_store *s, const struct blob_hash *h)
{
	struct blob_entry *n = find_present(s, h);
	/* A held blob has been marked as used by its first holder: skips thousands of files that an upload held before
	 * its job. */
	if (n && !n->hold_count)
		touch_blob(s, h);
	if (n)
		blob_entry_hold(s, n);
	return n != NULL;
}

void blob_release(struct blob_store *s, const struct blob_hash *h)
{
	struct blob_entry *n = blob_find(s, h);
	if (n && n->hold_count)
		blob_entry_release(s, n);
}

bool blob_is_held(struct blob_store *s, const struct blob_hash *h)
{
	const struct blob_entry *n = blob_find(s, h);
	return n && n->hold_count;
}

int blob_open(struct blob_store *s, const struct blob_hash *h, uint64_t *size, struct error *e)
{
	char path[BLOB_PATH_MAX], hex[BLOB_HEX_SIZE];
	blob_path(s, h, path, sizeof path);
	blob_hash_to_hex(h, hex);
	struct blob_entry *n = touch_blob(s, h);
	int fd = n ? disk_open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW, 0) : -1;
	if (fd < 0)
		return error_set(e, ENOENT, "there is no blob %s", hex);
	*size = n->size;
	n->was_opened_since_check = true;
	return fd;
}

void blob_path(const struct blob_store *s, const struct blob_hash *h, char *path, size_t size)
{
	char hex[BLOB_HEX_SIZE];
	blob_hash_to_hex(h, hex);
	snprintf(path, size, "%s/%s", s->folder, hex);
}

/* ---- blobs that are expected ---- */

int blob_hold_expected(struct blob_store *s, const struct blob_hash *h, struct error *e)
{
	if (blob_hold(s, h))
		return 0;
	struct blob_entry *n = blob_find(s, h);
	if (!n)
		n = add_entry(s, lower_bound(s, h), h, e);
	if (!n)
		return -ENOMEM;
	blob_entry_hold(s, n);
	return 0;
}

/* ---- writing ---- */

int blob_write_begin(struct blob_writer **out, struct blob_store *s, const struct blob_hash *h, uint64_t size,
		     struct error *e)
{
	int rc = check_fits(s, size, e);
	if (rc)
		return rc;
	struct blob_writer *w = mem_alloc(1, sizeof *w);
	if (!w)
		return error_set(e, ENOMEM, "no memory for a blob");
	w->store = s;
	w->hash = *h;
	w->size = size;
	w->md = EVP_MD_CTX_new();
	w->temp_number = ++s->last_temp_number;
	blob_temporary_path(s, w->temp_number, w->path, sizeof w->path);
	w->fd = disk_open(w->path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	if (w->fd < 0 && errno == ENOENT && disk_make_folder(s->folder, e) == 0) /* the folder has been removed */
		w->fd = disk_open(w->path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	w->is_created = w->fd >= 0;
	if (!w->is_created)
		rc = error_file(e, errno, s->folder);
	else if (!w->md || EVP_DigestInit_ex(w->md, EVP_sha256(), NULL) != 1)
		rc = error_set(e, ENOMEM, "SHA-256 cannot start");
	if (rc)
		blob_write_abort(w);
	else
		*out = w;
	return rc;
}

uint64_t blob_write_offset(const struct blob_writer *w)
{
	return w->offset;
}

void blob_write_pause(struct blob_writer *w)
{
	if (w->fd >= 0)
		disk_close(w->fd);
	w->fd = -1;
}

static int reopen_file(struct blob_writer *w, struct error *e)
{
	if (w->fd < 0)
		w->fd = disk_open(w->path, O_WRONLY | O_CLOEXEC | O_NOFOLLOW, 0);
	return w->fd < 0 ? error_file(e, errno, w->store->folder) : 0;
}

int blob_write_append(struct blob_writer *w, const void *bytes, size_t size, struct error *e)
{
	if (size > w->size - w->offset)
		return error_set(e, EMSGSIZE, "more bytes than were announced");
	int rc = evict_for_limit(w->store, size, e);
	if (!rc)
		rc = reopen_file(w, e);
	if (rc)
		return rc;
	if (EVP_DigestUpdate(w->md, bytes, size) != 1)
		return error_set(e, EIO, "SHA-256 failed");
	while (size) {
		struct iovec part = {(void *)(uintptr_t)bytes, size};
		ssize_t n = disk_pwritev(w->fd, &part, 1, (off_t)w->offset);
		if (n < 0 && (errno == EINTR || (disk_is_full(-errno) && free_disk_space(w->store))))
			continue;
		if (n < 0)
			return error_file(e, errno, w->store->folder);
		w->offset += (uint64_t)n;
		w->store->partial_bytes += (uint64_t)n;
		bytes = (const char *)bytes + n;
		size -= (size_t)n;
	}
	return 0;
}

static int check_written(struct blob_writer *w, struct error *e)
{
	struct blob_hash actual;
	char hex[BLOB_HEX_SIZE];
	if (w->offset != w->size)
		return error_set(e, EBADMSG, "a blob of %llu bytes instead of %llu", (unsigned long long)w->offset,
				 (unsigned long long)w->size);
	if (EVP_DigestFinal_ex(w->md, actual.bytes, NULL) != 1)
		return error_set(e, EIO, "SHA-256 failed");
	blob_hash_to_hex(&w->hash, hex);
	if (!blob_hash_equal(&actual, &w->hash))
		return error_set(e, EBADMSG, "the bytes do not match the blob %s", hex);
	return 0;
}

/* Marks a held entry as present: its file has been written and its hash checked. */
static void mark_present(struct blob_store *s, struct blob_entry *n, uint64_t size)
{
	n->is_missing = n->was_opened_since_check = false;
	n->size = size;
	s->bytes += size;
	n->check_time = clock_seconds();
}

/* Makes a written file durable. The file of a cache is not flushed, because it is hashed before its first use after a
 * restart. It is closed, though: only close reports errors of network file systems; local ones report them in write. */
static int make_durable(struct blob_writer *w)
{
	int fd = w->fd;
	if (!w->store->is_cache)
		return disk_fsync(fd);
	w->fd = -1;
	return disk_close(fd);
}

static int finish_writing(struct blob_writer *w, struct error *e)
{
	struct blob_store *s = w->store;
	char path[BLOB_PATH_MAX];
	int rc = check_written(w, e);
	if (!rc)
		rc = reopen_file(w, e);
	if (rc)
		return rc;
	if (blob_hold(s, &w->hash)) { /* another writer stored it meanwhile */
		disk_unlink(w->path);
		return 0;
	}
	blob_path(s, &w->hash, path, sizeof path);
	if (make_durable(w) || disk_rename(w->path, path))
		return error_file(e, errno, s->folder);
	rc = s->is_cache ? 0 : disk_sync_folder(s->folder, e);
	if (!rc)
		rc = blob_hold_expected(s, &w->hash, e);
	if (!rc)
		mark_present(s, blob_find(s, &w->hash), w->size);
	return rc;
}

static void writer_free(struct blob_writer *w)
{
	w->store->partial_bytes -= w->offset;
	blob_write_pause(w);
	EVP_MD_CTX_free(w->md);
	mem_free(w);
}

int blob_write_commit(struct blob_writer *w, struct error *e)
{
	int rc = finish_writing(w, e);
	if (rc)
		disk_unlink(w->path);
	writer_free(w);
	return rc;
}

void blob_write_abort(struct blob_writer *w)
{
	if (w->is_created)
		disk_unlink(w->path);
	writer_free(w);
}

/* ---- files of a batch ---- */

void blob_temporary_path(const struct blob_store *s, uint64_t number, char *path, size_t size)
{
	snprintf(path, size, "%s/tmp.%ld.%llu", s->folder, (long)getpid(), (unsigned long long)number);
}

int blob_write_defer(struct blob_writer *w, struct blob_deferred *deferred, struct error *e)
{
	int rc = check_written(w, e);
	if (!rc)
		rc = blob_hold_expected(w->store, &w->hash, e);
	if (rc) {
		blob_write_abort(w);
		return rc;
	}
	*deferred = (struct blob_deferred){w->hash, w->size, w->temp_number};
	w->offset = 0; /* so that writer_free does not subtract the bytes from `partial_bytes`; blob_deferred_release
			  will */
	writer_free(w);
	return 0;
}

void blob_deferred_publish(struct blob_store *s, const struct blob_deferred *deferred)
{
	struct blob_entry *n = blob_find(s, &deferred->hash);
	if (n->is_missing)
		mark_present(s, n, deferred->size);
}

bool blob_deferred_release(struct blob_store *s, const struct blob_deferred *deferred)
{
	s->partial_bytes -= deferred->size;
	struct blob_entry *n = blob_find(s, &deferred->hash); /* exists, because it is held */
	blob_entry_release(s, n);
	return n->hold_count == 0 && n->is_missing;
}

void blob_store_sweep(struct blob_store *s)
{
	size_t remaining = 0;
	for (size_t i = 0; i < s->count; i++) {
		struct blob_entry *n = s->entries[i];
		if (n->is_missing && !n->hold_count)
			mem_free(n);
		else
			s->entries[remaining++] = n;
	}
	s->count = remaining;
	s->evicted_count = 0;
}
