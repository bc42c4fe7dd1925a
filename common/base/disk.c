/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/disk.h"

#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

static int system_open(const char *path, int flags, mode_t mode)
{
	return open(path, flags, mode);
}

static int system_stat(const char *path, struct stat *st)
{
	return lstat(path, st);
}

static int system_fstat(int fd, struct stat *st)
{
	return fstat(fd, st);
}

static int system_touch(const char *path)
{
	return utimensat(AT_FDCWD, path, NULL, 0);
}

static uint64_t system_capacity(const char *path)
{
	struct statvfs st;
	uint64_t bytes;
	return statvfs(path, &st) || __builtin_mul_overflow((uint64_t)st.f_blocks, st.f_frsize, &bytes) ? 0 : bytes;
}

static uint64_t system_available(const char *path)
{
	struct statvfs st;
	uint64_t bytes;
	bool unknown = statvfs(path, &st) || __builtin_mul_overflow((uint64_t)st.f_bavail, st.f_frsize, &bytes);
	return unknown ? UINT64_MAX : bytes;
}

const struct disk disk_system = {
	.open = system_open,
	.close = close,
	.read = read,
	.pread = pread,
	.write = write,
	.pwritev = pwritev,
	.ftruncate = ftruncate,
	.fallocate = fallocate,
	.posix_fallocate = posix_fallocate,
	.fsync = fsync,
	.fdatasync = fdatasync,
	.rename = rename,
	.unlink = unlink,
	.mkdir = mkdir,
	.rmdir = rmdir,
	.stat = system_stat,
	.fstat = system_fstat,
	.touch = system_touch,
	.flock = flock,
	.opendir = opendir,
	.readdir = readdir,
	.capacity = system_capacity,
	.available = system_available,
};
const struct disk *disk_calls = &disk_system;

void disk_set_calls(const struct disk *calls)
{
	disk_calls = calls ? calls : &disk_system;
}

int disk_write_all(int fd, const void *bytes, size_t size)
{
	const char *p = bytes;
	while (size) {
		ssize_t n = disk_write(fd, p, size);
		if (n < 0 && errno != EINTR)
			return -errno;
		if (n == 0)
			return -ENOSPC;
		if (n > 0) {
			p += n;
			size -= (size_t)n;
		}
	}
	return 0;
}

/* Creates a new file. An existing file of that name is unlinked first, never written to: it may be a link to a file of
 * another user, or another process may have it open with wider permissions. */
static int create_new(const char *path, mode_t mode)
{
	int fd = disk_open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
	if (fd < 0 && errno == EEXIST && disk_unlink(path) == 0)
		fd = disk_open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
	if (fd >= 0 && (mode & 077) && fchmod(fd, mode)) { /* the umask may have removed permissions */
		int code = errno;
		disk_close(fd);
		disk_unlink(path);
		errno = code;
		return -1;
	}
	return fd;
}

int disk_replace(const char *path, const void *bytes, size_t size, mode_t mode, struct error *e)
{
	char temporary[4096];
	int n = snprintf(temporary, sizeof temporary, "%s.tmp", path);
	if (n < 0 || (size_t)n >= sizeof temporary)
		return error_set(e, ENAMETOOLONG, "%s: the name is too long", path);
	int fd = create_new(temporary, mode);
	int rc = fd < 0 ? -errno : disk_write_all(fd, bytes, size);
	if (!rc && disk_fsync(fd))
		rc = -errno;
	if (fd >= 0 && disk_close(fd) && !rc)
		rc = -errno;
	if (!rc && disk_rename(temporary, path))
		rc = -errno;
	if (!rc)
		return 0;
	if (fd >= 0)
		disk_unlink(temporary);
	return error_file(e, -rc, path);
}

int disk_sync_folder(const char *path, struct error *e)
{
	int fd = disk_open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC, 0);
	int rc = fd < 0 || disk_fsync(fd) ? error_file(e, errno, path) : 0;
	if (fd >= 0)
		disk_close(fd);
	return rc;
}

int disk_make_folder(const char *path, struct error *e)
{
	char parent[4096];
	/* Flushed again: an interrupted start may have left it not durable. */
	bool existed = disk_mkdir(path, 0700) != 0;
	if (existed && errno != EEXIST)
		return error_file(e, errno, path);
	int n = snprintf(parent, sizeof parent, "%s", path);
	if (n < 0 || (size_t)n >= sizeof parent)
		return error_set(e, ENAMETOOLONG, "%s: the name is too long", path);
	while (n > 1 && parent[n - 1] == '/')
		parent[--n] = 0;
	char *slash = strrchr(parent, '/');
	if (slash == parent)
		slash[1] = 0;
	else if (slash)
		*slash = 0;
	int rc = disk_sync_folder(slash ? parent : ".", e);
	return existed && rc == -EACCES ? 0 : rc; /* the folder exists; its parent cannot be opened to be flushed */
}

void disk_list_begin(struct disk_list *l, const char *path)
{
	*l = (struct disk_list){.path = path, .dir = disk_opendir(path)};
	l->first_errno = l->dir ? 0 : errno;
}

const char *disk_list_next(struct disk_list *l)
{
	const struct dirent *entry = NULL;
	do {
		errno = 0;
		entry = l->dir && !l->first_errno ? disk_readdir(l->dir) : NULL;
		if (!entry && errno)
			l->first_errno = errno;
	} while (entry && (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0));
	return entry ? entry->d_name : NULL;
}

int disk_list_end(struct disk_list *l, int rc, struct error *e)
{
	if (l->dir)
		closedir(l->dir);
	l->dir = NULL;
	return !rc && l->first_errno ? error_file(e, l->first_errno, l->path) : rc;
}
