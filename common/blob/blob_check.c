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
	double begun;	/* when the check began, s of the monotonic clock */
	bool was_given; /* the entry's `given` when the check began */
	bool whole;	/* the end of the file has been reached */
	int fd, rc;	/* of the file; first error while reading */
	EVP_MD_CTX *md;
	struct error error;
};

int blob_check_begin(struct blob_check **out, struct blob_store *s, const struct blob_hash *h, double seconds,
		     struct error *e)
{
	char path[BLOB_PATH_MOST];
	struct stat st;
	struct blob_entry *n = blob_find(s, h);
	blob_path(s, h, path, sizeof path);
	if (!n || n->gone)
		return error_set(e, ENOENT, "there is no %s", path);
	if (n->checked > 0 && (seconds == BLOB_SINCE_GIVEN ? !n->given : clock_seconds() - n->checked <= seconds) &&
	    (disk_stat(path, &st) == 0 || errno != ENOENT)) /* a cache can be emptied at any time */
		return 0;
	struct blob_check *c = mem_alloc(1, sizeof *c);
	if (!c)
		return error_set(e, ENOMEM, "no memory to check %s", path);
	*c = (struct blob_check){
		.store = s, .hash = *h, .begun = clock_seconds(), .was_given = n->given, .fd = -1, .rc = 0};
	n->given = false; /* a file opened from now on may change after this check has read it */
	blob_take(s, n);
	n->checks++;
	*out = c;
	return 1;
}

bool blob_is_being_checked(struct blob_store *s, const struct blob_hash *h)
{
	const struct blob_entry *n = blob_find(s, h);
	return n && n->checks;
}

/* Opens the file. Called on any thread without a lock: of the store only the path is used, which never changes. */
static int check_open(struct blob_check *c, const char *path)
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
static int check_some(struct blob_check *c, const char *path)
{
	enum { PIECE = 1 << 18, PIECES = 128 };
	unsigned char *bytes = mem_alloc(PIECE, 1);
	if (!bytes)
		return error_set(&c->error, ENOMEM, "no memory to check %s", path);
	int rc = 0;
	for (int i = 0; !rc && !c->whole && i < PIECES; i++) {
		ssize_t n = disk_read(c->fd, bytes, PIECE);
		c->whole = n == 0;
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
	char path[BLOB_PATH_MOST];
	blob_path(c->store, &c->hash, path, sizeof path);
	if (c->fd < 0)
		c->rc = check_open(c, path);
	if (!c->rc)
		c->rc = check_some(c, path);
	return !c->rc && !c->whole;
}

/* Returns 0 if the contents are right, -EBADMSG if they are wrong, -ENOENT if there is no file, or another -errno if
 * they could not be read. */
static int check_result(struct blob_check *c, struct error *e)
{
	struct blob_hash got;
	if (c->rc) {
		*e = c->error;
		return c->rc;
	}
	if (!c->whole)
		return error_set(e, ECANCELED, "the check was not finished");
	if (EVP_DigestFinal_ex(c->md, got.bytes, NULL) != 1)
		return error_set(e, EIO, "SHA-256 failed");
	return blob_hash_equal(&got, &c->hash) ? 0 : -EBADMSG;
}

/* Marks a blob as missing. there: its file exists with wrong contents, and is kept as
 * damaged.NAME. Returns -EBADMSG. */
static int mark_gone(struct blob_store *s, struct blob_entry *n, bool there, struct error *e)
{
	char path[BLOB_PATH_MOST], damaged[BLOB_PATH_MOST + 16], hex[BLOB_HEX_SIZE];
	blob_hex(&n->hash, hex);
	blob_path(s, &n->hash, path, sizeof path);
	snprintf(damaged, sizeof damaged, "%s/damaged.%s", s->folder, hex);
	if (!n->gone && there)
		disk_rename(path, damaged);
	n->gone = true;
	s->bytes -= n->size;
	n->size = 0;
	return error_set(e, EBADMSG, there ? "%s is damaged: its contents do not match its name" : "%s is gone", path);
}

int blob_check_end(struct blob_check *c, struct error *e)
{
	struct error ignored;
	struct blob_store *s = c->store;
	struct blob_entry *n = blob_find(s, &c->hash); /* exists, because the check holds it */
	int rc = check_result(c, e ? e : &ignored);
	if (n->checked > c->begun) { /* it has been written again, or another check has succeeded, in the meantime */
		rc = 0;
	} else if (rc == -EBADMSG || rc == -ENOENT) {
		rc = mark_gone(s, n, rc == -EBADMSG, e);
	} else if (rc) {
		n->given |= c->was_given;
	} else {
		n->checked = clock_seconds();
	}
	blob_put(s, n);
	n->checks--;
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
