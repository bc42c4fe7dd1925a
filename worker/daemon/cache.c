/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/cache.h"

#include "common/base/log.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_BYTES = 4096, SLOTS = 256 };

static int make_folders(char *path, struct error *e)
{
	for (char *p = path + 1;; p++) {
		if (*p && *p != '/')
			continue;
		char saved = *p;
		*p = 0;
		if (mkdir(path, 0700) && errno != EEXIST)
			return error_set(e, errno, "%s: %s", path, strerror(errno));
		*p = saved;
		if (!saved)
			return 0;
	}
}

/* Refuses a folder of another user, or one that others can write to: they could choose what this worker renders. The
 * parent folder (allow_root) may be root's. */
static int check_owner(const char *path, bool allow_root, struct error *e)
{
	struct stat st;
	if (stat(path, &st))
		return error_set(e, errno, "%s: %s", path, strerror(errno));
	bool is_ours = st.st_uid == geteuid();
	if (!is_ours && !(allow_root && st.st_uid == 0))
		return error_set(e, EPERM,
				 "%s belongs to another user: its contents cannot be trusted (use --cache DIR)", path);
	if (is_ours && (st.st_mode & S_IWOTH) && !(allow_root && (st.st_mode & S_ISVTX)))
		return error_set(e, EPERM,
				 "%s is writable for everybody: its contents cannot be trusted (use --cache DIR)",
				 path);
	return 0;
}

static int make_slot(const char *path, struct error *e)
{
	if (mkdir(path, 0700) && errno != EEXIST)
		return error_set(e, errno, "%s: %s", path, strerror(errno));
	return check_owner(path, false, e);
}

static int make_base_folder(const char *folder, char path[PATH_BYTES], struct error *e)
{
	const char *xdg = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
	int n;
	if (folder)
		n = snprintf(path, PATH_BYTES, "%s", folder);
	else if (xdg && *xdg == '/')
		n = snprintf(path, PATH_BYTES, "%s/hslt", xdg);
	else if (home && *home == '/')
		n = snprintf(path, PATH_BYTES, "%s/.cache/hslt", home);
	else
		return error_set(e, EINVAL, "no folder for the cache: $HOME is not set; use --cache DIR");
	if (n <= 0 || n >= PATH_BYTES - 32)
		return error_set(e, EINVAL, "the name of the cache's folder is empty or too long");
	int rc = make_folders(path, e);
	return rc ? rc : check_owner(path, true, e);
}

/* Counts this start of the slot. A failure is only logged, since the worker can work without a counted identity. */
static void count_start(struct cache *c, const char *base, int slot)
{
	char name[32];
	struct error e;
	snprintf(name, sizeof name, "slot-%d.life", slot);
	if (worker_identity_count_start(&c->identity, base, name, &e))
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
}

/* Locks a slot; -EWOULDBLOCK if another worker has it. */
static int lock_slot(const char *base, int slot, int *lock, struct error *e)
{
	char path[PATH_BYTES + 32];
	snprintf(path, sizeof path, "%s/slot-%d.lock", base, slot);
	*lock = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
	if (*lock < 0)
		return error_set(e, errno, "%s: %s", path, strerror(errno));
	if (flock(*lock, LOCK_EX | LOCK_NB) == 0)
		return 0;
	close(*lock);
	*lock = -1;
	return error_set(e, EWOULDBLOCK, "%s: another worker uses it", path);
}

static void slot_path(const char *base, int slot, char path[PATH_BYTES + 32])
{
	snprintf(path, PATH_BYTES + 32, "%s/slot-%d", base, slot);
}

int cache_open(struct cache *c, const char *folder, uint64_t limit, struct error *e)
{
	char base[PATH_BYTES], path[PATH_BYTES + 32];
	c->blobs = NULL;
	c->lock_fd = -1;
	c->folder = folder;
	int rc = make_base_folder(folder, base, e);
	if (rc)
		return rc;
	for (c->slot = 0; c->slot < SLOTS; c->slot++) {
		rc = lock_slot(base, c->slot, &c->lock_fd, e);
		if (rc == -EWOULDBLOCK)
			continue;
		if (rc)
			return rc;
		slot_path(base, c->slot, path);
		count_start(c, base, c->slot);
		rc = make_slot(path, e);
		if (!rc)
			rc = blob_store_open(&c->blobs, path, limit, e);
		if (rc) {
			cache_close(c);
			return rc;
		}
		blob_store_use_as_cache(c->blobs);
		while (blob_store_trim(c->blobs))
			continue;
		return 0;
	}
	return error_set(e, EBUSY, "%s: %d workers use this cache already", base, SLOTS);
}

int cache_restore_folder(struct cache *c, struct error *e)
{
	char base[PATH_BYTES], path[PATH_BYTES + 32];
	struct stat st;
	int lock;
	int rc = make_base_folder(c->folder, base, e);
	if (rc)
		return rc;
	slot_path(base, c->slot, path);
	if (stat(path, &st) == 0 || errno != ENOENT)
		return 0;
	if (fstat(c->lock_fd, &st) == 0 && st.st_nlink == 0) { /* the lock's file has been removed, too */
		rc = lock_slot(base, c->slot, &lock, e);
		if (rc)
			return rc;
		close(c->lock_fd);
		c->lock_fd = lock;
	}
	log_event(LOG_SPOOL_FAULT, "path=%s text=\"the cache was removed: it is made anew\"", log_quote(path).text);
	return make_slot(path, e);
}

void cache_close(struct cache *c)
{
	blob_store_close(c->blobs);
	if (c->lock_fd >= 0)
		close(c->lock_fd);
	c->blobs = NULL;
	c->lock_fd = -1;
}
