/* SPDX-License-Identifier: Apache-2.0 */
#include "common/blob/blob_check.h"

#include "common/base/clock.h"
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/blob/blob_state.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <stdio.h>

struct blob_check {
	struct blob_store *store;
	struct blob_hash hash;
	double begin_time;    /* when the check began, s of the monotonic clock */
	bool was_opened;      /* the entry's `was_opened_since_check` when the check began */
	bool has_reached_end; /* the end of the file has been reached */
	int fd, rc;	      /* of the file; first error while reading */
	EVP_MD_CTX *md;
	struct error error;
};

int blob_check_begin(struct blob_check **out, struct blob_store *s, const struct blob_hash *h, double seconds,
		     struct error *e)
{
	char path[BLOB_PATH_MAX];
	struct stat st;
	struct blob_entry *n = blob_find(s, h);
	blob_path(s, h, path, sizeof path);
	if (!n || n->is_missing)
		return error_set(e, ENOENT, "there is no %s", path);
	if (n->check_time > 0 &&
	    (seconds == BLOB_SINCE_OPENED ? !n->was_opened_since_check : clock_seconds() - n->check_time <= seconds) &&
	    (disk_stat(path, &st) == 0 || errno != ENOENT)) /* a cache can be emptied at any time */
		return 0;
	struct blob_check *c = mem_alloc(1, sizeof *c);
	if (!c)
		return error_set(e, ENOMEM, "no memory to check %s", path);
	*c = (struct blob_check){.store = s,
				 .hash = *h,
				 .begin_time = clock_seconds(),
				 .was_opened = n->was_opened_since_check,
				 .fd = -1,
				 .rc = 0};
	n->was_opened_since_check = false; /* a file opened from now on may change after this check has read it */
	blob_entry_hold(s, n);
	n->check_count++;
	*out = c;
	return 1;
}

bool blob_is_being_checked(struct blob_store *s, const struct blob_hash *h)
{
	const struct blob_entry *n = blob_find(s, h);
	return n && n->check_count;
}

/* Opens the file. Called on any thread without a lock: of the store only the path is used, which never changes. */
static int open_file(struct blob_check *c, const char *path)
{
	c->fd = disk_open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW, 0);
	if (c->fd < 0)
		return error_file(&c->error, errno, path);
	c->md = EVP_MD_CTX_new();
	if (!c->md || EVP_DigestInit_ex(c->md, EVP_sha256(), NULL) != 1)
		return error_set(&c->error, ENOMEM, "no memory to check %s", path);
	return 0;
}

/* Hashes the next 32 MiB. */
static int hash_next_part(struct blob_check *c, const char *path)
{
	enum { PIECE_SIZE = 1 << 18, PIECE_COUNT = 128 };
	unsigned char *bytes = mem_alloc(PIECE_SIZE, 1);
	if (!bytes)
		return error_set(&c->error, ENOMEM, "no memory to check %s", path);
	int rc = 0;
	for (int i = 0; !rc && !c->has_reached_end && i < PIECE_COUNT; i++) {
		ssize_t n = disk_read(c->fd, bytes, PIECE_SIZE);
		c->has_reached_end = n == 0;
		if (n < 0 && errno != EINTR)
			rc = error_file(&c->error, errno, path);
		else if (n > 0 && EVP_DigestUpdate(c->md, bytes, (size_t)n) != 1)
			rc = error_set(&c->error, EIO, "SHA-256 failed");
	}
	mem_free(bytes);
	return rc;
}

bool blob_check_read(struct blob_check *c)
{
	char path[BLOB_PATH_MAX];
	blob_path(c->store, &c->hash, path, sizeof path);
	if (c->fd < 0)
		c->rc = open_file(c, path);
	if (!c->rc)
		c->rc = hash_next_part(c, path);
	return !c->rc && !c->has_reached_end;
}

/* Returns 0 if the contents are right, -EBADMSG if they are wrong, -ENOENT if there is no file, or another -errno if
 * they could not be read. */
static int compare_hash(struct blob_check *c, struct error *e)
{
	struct blob_hash actual;
	if (c->rc) {
		*e = c->error;
		return c->rc;
	}
	if (!c->has_reached_end)
		return error_set(e, ECANCELED, "the check was not finished");
	if (EVP_DigestFinal_ex(c->md, actual.bytes, NULL) != 1)
		return error_set(e, EIO, "SHA-256 failed");
	return blob_hash_equal(&actual, &c->hash) ? 0 : -EBADMSG;
}

/* Marks a blob as missing. file_exists: its file exists with wrong contents, and is kept as
 * damaged.NAME. Returns -EBADMSG. */
static int mark_missing(struct blob_store *s, struct blob_entry *n, bool file_exists, struct error *e)
{
	char path[BLOB_PATH_MAX], damaged[BLOB_PATH_MAX + 16], hex[BLOB_HEX_SIZE];
	blob_hash_to_hex(&n->hash, hex);
	blob_path(s, &n->hash, path, sizeof path);
	snprintf(damaged, sizeof damaged, "%s/damaged.%s", s->folder, hex);
	if (!n->is_missing && file_exists)
		disk_rename(path, damaged);
	n->is_missing = true;
	s->bytes -= n->size;
	n->size = 0;
	return error_set(e, EBADMSG, file_exists ? "%s is damaged: its contents do not match its name" : "%s is gone",
			 path);
}

int blob_check_end(struct blob_check *c, struct error *e)
{
	struct error ignored;
	struct blob_store *s = c->store;
	struct blob_entry *n = blob_find(s, &c->hash); /* exists, because the check holds it */
	int rc = compare_hash(c, e ? e : &ignored);
	if (n->check_time >
	    c->begin_time) { /* it has been written again, or another check has succeeded, in the meantime */
		rc = 0;
	} else if (rc == -EBADMSG || rc == -ENOENT) {
		rc = mark_missing(s, n, rc == -EBADMSG, e);
	} else if (rc) {
		n->was_opened_since_check |= c->was_opened;
	} else {
		n->check_time = clock_seconds();
	}
	blob_entry_release(s, n);
	n->check_count--;
	if (c->fd >= 0)
		disk_close(c->fd);
	EVP_MD_CTX_free(c->md);
	mem_free(c);
	return rc;
}

int blob_check(struct blob_store *s, const struct blob_hash *h, double seconds, struct error *e)
{
	struct blob_check *c;
	int rc = blob_check_begin(&c, s, h, seconds, e);
	if (rc <= 0)
		return rc;
	while (blob_check_read(c))
		continue;
	return blob_check_end(c, e);
}
