/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A store is a sorted array of entries (hash, size, holds) that mirrors a folder: opening reads the folder, looking up
 * is a binary search, and the disk is only read for contents. The entry of an evicted blob stays in the array, marked
 * as missing, until a quarter of all entries are: one large file may evict thousands of a million small ones, and each
 * removal from the array would move the rest.
 *
 * Writing: blob_write_begin creates a temporary file; blob_write_add makes room, appends and hashes; blob_write_commit
 * compares the hash, flushes (unless the store is a cache), renames, and adds the entry. Until then the blob does not
 * exist. Instead of blob_write_commit, blob_write_keep leaves flushing and renaming to a batch; the entry then exists
 * at once, but is marked as missing until blob_enter.
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
	BLOCK = 4096,  /* bytes that even the smallest file takes on the disk */
	EVICTIONS = 8, /* evictions at a time that are always allowed */
};

struct blob_writer {
	struct blob_store *store;
	struct blob_hash hash;
	uint64_t size, at;	   /* bytes announced; bytes written so far */
	int fd;			   /* of the temporary file; -1: not open */
	bool made;		   /* the temporary file has been created */
	uint64_t number;	   /* of the temporary file */
	char path[BLOB_PATH_MOST]; /* of the temporary file */
	EVP_MD_CTX *md;
};

/* ---- the store ---- */

static void path_of(const struct blob_store *s, const char *name, char path[BLOB_PATH_MOST])
{
	snprintf(path, BLOB_PATH_MOST, "%s/%s", s->folder, name);
}

/* Returns the index of the first entry whose hash is h or above; s->count if there is none. */
static size_t place_of(const struct blob_store *s, const struct blob_hash *h)
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
	size_t i = place_of(s, h);
	return i < s->count && blob_hash_equal(&s->entries[i]->hash, h) ? s->entries[i] : NULL;
}

/* Like blob_find, but returns NULL also for an entry that is marked as missing. */
static struct blob_entry *find_there(struct blob_store *s, const struct blob_hash *h)
{
	struct blob_entry *n = blob_find(s, h);
	return n && !n->gone ? n : NULL;
}

static int reserve(struct blob_store *s, size_t count, struct error *e)
{
	if (count <= s->capacity)
		return 0;
	size_t want = count > 2 * s->capacity ? count : 2 * s->capacity;
	struct blob_entry **grown = mem_grow(s->entries, s->capacity * sizeof *grown, want * sizeof *grown);
	if (!grown)
		return error_set(e, ENOMEM, "no memory for the list of blobs");
	s->entries = grown;
	s->capacity = want;
	return 0;
}

/* Inserts an entry, marked as missing, at index i. Returns NULL if memory is out. */
static struct blob_entry *add_entry(struct blob_store *s, size_t i, const struct blob_hash *h, struct error *e)
{
	struct blob_entry *n = reserve(s, s->count + 1, e) ? NULL : mem_alloc(1, sizeof *n);
	if (!n) {
		error_set(e, ENOMEM, "no memory for the list of blobs");
		return NULL;
	}
	memmove(&s->entries[i + 1], &s->entries[i], (s->count++ - i) * sizeof *s->entries);
	s->entries[i] = n;
	*n = (struct blob_entry){.hash = *h, .gone = true};
	return n;
}

static int by_hash(const void *a, const void *b)
{
	const struct blob_entry *const *x = a, *const *y = b;
	return memcmp((*x)->hash.bytes, (*y)->hash.bytes, BLOB_HASH_SIZE);
}

/* A file found in the folder, and when it was last used. */
struct found {
	struct blob_hash hash;
	uint64_t size;
	struct timespec used;
};

static int by_age(const void *a, const void *b)
{
	const struct found *x = a, *y = b;
	if (x->used.tv_sec != y->used.tv_sec)
		return x->used.tv_sec < y->used.tv_sec ? -1 : 1;
	return (x->used.tv_nsec > y->used.tv_nsec) - (x->used.tv_nsec < y->used.tv_nsec);
}

/* Reads the folder, oldest use first, so that the order of use survives a restart. */
static int read_folder(struct blob_store *s, struct error *e)
{
	struct found *all = NULL;
	size_t count = 0;
	int rc = 0;
	struct disk_list l;
	disk_list_begin(&l, s->folder);
	for (const char *name; !rc && (name = disk_list_next(&l));) {
		struct stat st;
		struct blob_hash h;
		char path[BLOB_PATH_MOST];
		path_of(s, name, path);
		if (strncmp(name, "tmp.", 4) == 0)
			disk_unlink(path);
		if (!blob_from_hex(name, &h))
			continue;
		if (disk_stat(path, &st)) { /* fails the whole opening: the blob must not be taken for missing */
			rc = error_file(e, errno, path);
			break;
		}
		if (!S_ISREG(st.st_mode))
			continue;
		struct found *grown = list_room(all, count, sizeof *all);
		if (!grown) {
			rc = error_set(e, ENOMEM, "%s: no memory for its list of files", s->folder);
			break;
		}
		all = grown;
		all[count++] = (struct found){h, (uint64_t)st.st_size, st.st_mtim};
	}
	rc = disk_list_end(&l, rc, e);
	if (count)
		qsort(all, count, sizeof *all, by_age);
	if (!rc)
		rc = reserve(s, count, e);
	for (size_t i = 0; !rc && i < count; i++) {
		struct blob_entry *n = add_entry(s, i, &all[i].hash, e);
		rc = n ? 0 : -ENOMEM;
		if (n) {
			s->bytes += n->size = all[i].size;
			n->gone = false;
			blob_idle_enter(s, n);
		}
	}
	if (s->count)
		qsort(s->entries, s->count, sizeof *s->entries, by_hash);
	mem_free(all);
	return rc;
}

bool blob_store_evict(struct blob_store *s)
{
	struct blob_entry *oldest = TAILQ_FIRST(&s->idle);
	char path[BLOB_PATH_MOST];
	if (!oldest)
		return false;
	blob_path(s, &oldest->hash, path, sizeof path);
	disk_unlink(path);
	blob_idle_leave(s, oldest);
	s->bytes -= oldest->size;
	oldest->size = 0;
	oldest->gone = true;
	if (++s->evicted > s->count / 4)
		blob_store_sweep(s);
	return true;
}

static int refuse_excess(const struct blob_store *s, uint64_t need, struct error *e)
{
	return error_set(e, EFBIG, "%s: %llu more bytes exceed its limit of %llu, given what is in use", s->folder,
			 (unsigned long long)need, (unsigned long long)s->limit);
}

/* Returns 0 if `need` more bytes would fit into the limit beside the blobs that are held. */
static int could_fit(const struct blob_store *s, uint64_t need, struct error *e)
{
	uint64_t used = s->bytes - s->idle_bytes;
	if (!s->limit)
		return 0;
	if (need > s->limit)
		return error_set(e, EMSGSIZE, "%s: a file of %llu bytes exceeds its limit of %llu", s->folder,
				 (unsigned long long)need, (unsigned long long)s->limit);
	return used > s->limit - need ? refuse_excess(s, need, e) : 0;
}

/* Evicts blobs until `need` more bytes fit into the limit, but no more files than take that much space on the disk,
 * where each takes at least a block. Otherwise, a megabyte could mean evicting tens of thousands of files of a few
 * bytes, which takes seconds. An excess over the limit is then evicted when the next bytes arrive. */
static int make_room(struct blob_store *s, uint64_t need, struct error *e)
{
	uint64_t most = need / BLOCK + EVICTIONS;
	while (s->limit && s->bytes + s->arrived + need > s->limit && most--)
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
	s->limit = limit;
	TAILQ_INIT(&s->idle);
	int rc = strlen(folder) < BLOB_PATH_MOST - 2 * BLOB_HEX_SIZE
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
	s->cache = true;
}

void blob_store_ask(struct blob_store *s, bool (*more_room)(void *user), void *user)
{
	s->more_room = more_room;
	s->user = user;
}

/* Makes room on a full disk; false if there is nothing left to remove. */
static bool make_disk_room(struct blob_store *s)
{
	return (s->limit && blob_store_evict(s)) || (s->more_room && s->more_room(s->user));
}

bool blob_store_trim(struct blob_store *s)
{
	for (int i = 0; s->limit && s->bytes + s->arrived > s->limit; i++)
		if (i == BLOB_TRIM_MOST)
			return true;
		else if (!blob_store_evict(s))
			break;
	return false;
}

uint64_t blob_store_bytes(const struct blob_store *s)
{
	return s->bytes + s->arrived;
}

/* Marks a blob as the most recently used one, also on the disk for the next start. Returns NULL if it is missing. */
static struct blob_entry *use_blob(struct blob_store *s, const struct blob_hash *h)
{
	struct blob_entry *n = find_there(s, h);
	if (!n)
		return NULL;
	char path[BLOB_PATH_MOST];
	blob_path(s, h, path, sizeof path);
	if (!n->holds) {
		blob_idle_leave(s, n);
		blob_idle_enter(s, n);
	}
	if (s->limit)
		disk_touch(path);
	return n;
}

bool blob_has(struct blob_store *s, const struct blob_hash *h, uint64_t *size)
{
	struct blob_entry *n = find_there(s, h);
	if (n && size)
		*size = n->size;
	return n != NULL;
}

bool blob_hold(struct blob_store *s, const struct blob_hash *h)
{
	struct blob_entry *n = find_there(s, h);
	/* A held blob has been marked as used by its first holder: skips thousands of files that an upload held before
	 * its job. */
	if (n && !n->holds)
		use_blob(s, h);
	if (n)
		blob_take(s, n);
	return n != NULL;
}

void blob_release(struct blob_store *s, const struct blob_hash *h)
{
	struct blob_entry *n = blob_find(s, h);
	if (n && n->holds)
		blob_put(s, n);
}

bool blob_is_held(struct blob_store *s, const struct blob_hash *h)
{
	const struct blob_entry *n = blob_find(s, h);
	return n && n->holds;
}

int blob_open(struct blob_store *s, const struct blob_hash *h, uint64_t *size, struct error *e)
{
	char path[BLOB_PATH_MOST], hex[BLOB_HEX_SIZE];
	blob_path(s, h, path, sizeof path);
	blob_hex(h, hex);
	struct blob_entry *n = use_blob(s, h);
	int fd = n ? disk_open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW, 0) : -1;
	if (fd < 0)
		return error_set(e, ENOENT, "there is no blob %s", hex);
	*size = n->size;
	n->given = true;
	return fd;
}

void blob_path(const struct blob_store *s, const struct blob_hash *h, char *path, size_t size)
{
	char hex[BLOB_HEX_SIZE];
	blob_hex(h, hex);
	snprintf(path, size, "%s/%s", s->folder, hex);
}

/* ---- blobs that are expected ---- */

int blob_expect(struct blob_store *s, const struct blob_hash *h, struct error *e)
{
	if (blob_hold(s, h))
		return 0;
	struct blob_entry *n = blob_find(s, h);
	if (!n)
		n = add_entry(s, place_of(s, h), h, e);
	if (!n)
		return -ENOMEM;
	blob_take(s, n);
	return 0;
}

/* ---- writing ---- */

int blob_write_begin(struct blob_writer **out, struct blob_store *s, const struct blob_hash *h, uint64_t size,
		     struct error *e)
{
	int rc = could_fit(s, size, e);
	if (rc)
		return rc;
	struct blob_writer *w = mem_alloc(1, sizeof *w);
	if (!w)
		return error_set(e, ENOMEM, "no memory for a blob");
	w->store = s;
	w->hash = *h;
	w->size = size;
	w->md = EVP_MD_CTX_new();
	w->number = ++s->temporary;
	blob_temporary_path(s, w->number, w->path, sizeof w->path);
	w->fd = disk_open(w->path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	if (w->fd < 0 && errno == ENOENT && disk_make_folder(s->folder, e) == 0) /* the folder has been removed */
		w->fd = disk_open(w->path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	w->made = w->fd >= 0;
	if (!w->made)
		rc = error_file(e, errno, s->folder);
	else if (!w->md || EVP_DigestInit_ex(w->md, EVP_sha256(), NULL) != 1)
		rc = error_set(e, ENOMEM, "SHA-256 cannot start");
	if (rc)
		blob_write_abort(w);
	else
		*out = w;
	return rc;
}

uint64_t blob_write_at(const struct blob_writer *w)
{
	return w->at;
}

void blob_write_pause(struct blob_writer *w)
{
	if (w->fd >= 0)
		disk_close(w->fd);
	w->fd = -1;
}

static int go_on(struct blob_writer *w, struct error *e)
{
	if (w->fd < 0)
		w->fd = disk_open(w->path, O_WRONLY | O_CLOEXEC | O_NOFOLLOW, 0);
	return w->fd < 0 ? error_file(e, errno, w->store->folder) : 0;
}

int blob_write_add(struct blob_writer *w, const void *bytes, size_t size, struct error *e)
{
	if (size > w->size - w->at)
		return error_set(e, EMSGSIZE, "more bytes than were announced");
	int rc = make_room(w->store, size, e);
	if (!rc)
		rc = go_on(w, e);
	if (rc)
		return rc;
	if (EVP_DigestUpdate(w->md, bytes, size) != 1)
		return error_set(e, EIO, "SHA-256 failed");
	while (size) {
		struct iovec part = {(void *)(uintptr_t)bytes, size};
		ssize_t n = disk_pwritev(w->fd, &part, 1, (off_t)w->at);
		if (n < 0 && (errno == EINTR || (disk_is_full(-errno) && make_disk_room(w->store))))
			continue;
		if (n < 0)
			return error_file(e, errno, w->store->folder);
		w->at += (uint64_t)n;
		w->store->arrived += (uint64_t)n;
		bytes = (const char *)bytes + n;
		size -= (size_t)n;
	}
	return 0;
}

static int check_written(struct blob_writer *w, struct error *e)
{
	struct blob_hash got;
	char hex[BLOB_HEX_SIZE];
	if (w->at != w->size)
		return error_set(e, EBADMSG, "a blob of %llu bytes instead of %llu", (unsigned long long)w->at,
				 (unsigned long long)w->size);
	if (EVP_DigestFinal_ex(w->md, got.bytes, NULL) != 1)
		return error_set(e, EIO, "SHA-256 failed");
	blob_hex(&w->hash, hex);
	if (!blob_hash_equal(&got, &w->hash))
		return error_set(e, EBADMSG, "the bytes do not match the blob %s", hex);
	return 0;
}

/* Marks a held entry as present: its file has been written and its hash checked. */
static void come_back(struct blob_store *s, struct blob_entry *n, uint64_t size)
{
	n->gone = n->given = false;
	n->size = size;
	s->bytes += size;
	n->checked = clock_seconds();
}

/* Makes a written file durable. The file of a cache is not flushed, because it is hashed before its first use after a
 * restart. It is closed, though: only close reports errors of network file systems; local ones report them in write. */
static int make_safe(struct blob_writer *w)
{
	int fd = w->fd;
	if (!w->store->cache)
		return disk_fsync(fd);
	w->fd = -1;
	return disk_close(fd);
}

static int finish_writing(struct blob_writer *w, struct error *e)
{
	struct blob_store *s = w->store;
	char path[BLOB_PATH_MOST];
	int rc = check_written(w, e);
	if (!rc)
		rc = go_on(w, e);
	if (rc)
		return rc;
	if (blob_hold(s, &w->hash)) { /* another writer stored it meanwhile */
		disk_unlink(w->path);
		return 0;
	}
	blob_path(s, &w->hash, path, sizeof path);
	if (make_safe(w) || disk_rename(w->path, path))
		return error_file(e, errno, s->folder);
	rc = s->cache ? 0 : disk_sync_folder(s->folder, e);
	if (!rc)
		rc = blob_expect(s, &w->hash, e);
	if (!rc)
		come_back(s, blob_find(s, &w->hash), w->size);
	return rc;
}

static void writer_free(struct blob_writer *w)
{
	w->store->arrived -= w->at;
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
	if (w->made)
		disk_unlink(w->path);
	writer_free(w);
}

/* ---- files of a batch ---- */

void blob_temporary_path(const struct blob_store *s, uint64_t number, char *path, size_t size)
{
	snprintf(path, size, "%s/tmp.%ld.%llu", s->folder, (long)getpid(), (unsigned long long)number);
}

int blob_write_keep(struct blob_writer *w, struct blob_kept *kept, struct error *e)
{
	int rc = check_written(w, e);
	if (!rc)
		rc = blob_expect(w->store, &w->hash, e);
	if (rc) {
		blob_write_abort(w);
		return rc;
	}
	*kept = (struct blob_kept){w->hash, w->size, w->number};
	w->at = 0; /* so that writer_free does not subtract the bytes from `arrived`; blob_let_go will */
	writer_free(w);
	return 0;
}

void blob_enter(struct blob_store *s, const struct blob_kept *kept)
{
	struct blob_entry *n = blob_find(s, &kept->hash);
	if (n->gone)
		come_back(s, n, kept->size);
}

bool blob_let_go(struct blob_store *s, const struct blob_kept *kept)
{
	s->arrived -= kept->size;
	struct blob_entry *n = blob_find(s, &kept->hash); /* exists, because it is held */
	blob_put(s, n);
	return n->holds == 0 && n->gone;
}

void blob_store_sweep(struct blob_store *s)
{
	size_t left = 0;
	for (size_t i = 0; i < s->count; i++) {
		struct blob_entry *n = s->entries[i];
		if (n->gone && !n->holds)
			mem_free(n);
		else
			s->entries[left++] = n;
	}
	s->count = left;
	s->evicted = 0;
}
