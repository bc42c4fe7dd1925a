/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All file I/O of data that must survive: the coordinator's spool, blob stores, film files, checked files. The
 * functions are the system's, with its conventions (-1 and errno), called through a table that tests replace by a disk
 * that is full, fails, or loses what was not flushed. tests/lint/disk.sh checks that nothing goes around it; SQLite has
 * its own layer (its VFS). Any thread; call disk_use before there is more than one. Allocates nothing.
 *
 * Flushing a file makes its bytes and its length durable. Its name becomes durable by flushing its folder. A flush that
 * failed is never repeated: the data may be lost, and the next flush would report success.
 */
#ifndef COMMON_BASE_DISK_H
#define COMMON_BASE_DISK_H

#include "common/base/error.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>

/* X(result, NAME, parameters, arguments): disk_NAME calls the table's function. */
#define DISK_CALLS(X)                                                                                                \
	X(int, open, (const char *path, int flags, mode_t mode), (path, flags, mode))                                \
	X(int, close, (int fd), (fd))                                                                                \
	X(ssize_t, read, (int fd, void *bytes, size_t size), (fd, bytes, size))                                      \
	X(ssize_t, pread, (int fd, void *bytes, size_t size, off_t at), (fd, bytes, size, at))                       \
	X(ssize_t, write, (int fd, const void *bytes, size_t size), (fd, bytes, size))                               \
	X(ssize_t, pwritev, (int fd, const struct iovec *parts, int count, off_t at), (fd, parts, count, at))        \
	X(int, ftruncate, (int fd, off_t size), (fd, size))                                                          \
	X(int, fallocate, (int fd, int mode, off_t at, off_t size), (fd, mode, at, size))                            \
	X(int, posix_fallocate, (int fd, off_t at, off_t size), (fd, at, size)) /* returns the error code */         \
	X(int, fsync, (int fd), (fd))                                                                                \
	X(int, fdatasync, (int fd), (fd))                                                                            \
	X(int, rename, (const char *from, const char *to), (from, to))                                               \
	X(int, unlink, (const char *path), (path))                                                                   \
	X(int, mkdir, (const char *path, mode_t mode), (path, mode))                                                 \
	X(int, rmdir, (const char *path), (path))                                                                    \
	X(int, stat, (const char *path, struct stat *st), (path, st)) /* of the link itself */                       \
	X(int, fstat, (int fd, struct stat *st), (fd, st))                                                           \
	X(int, touch, (const char *path), (path))                                                                    \
	X(int, flock, (int fd, int what), (fd, what))                                                                \
	X(DIR *, opendir, (const char *path), (path))                                                                \
	X(struct dirent *, readdir, (DIR * d), (d)) /* NULL: the end, or with errno, which was 0 before, an error */ \
	X(uint64_t, capacity, (const char *path), (path)) /* bytes of its file system, used or not; 0: not known */  \
	X(uint64_t, available, (const char *path),                                                                   \
	  (path)) /* bytes of it that may still be written; UINT64_MAX: not known */

#define DISK_MEMBER(result, name, parameters, arguments) result(*name) parameters;
struct disk {
	DISK_CALLS(DISK_MEMBER)
};
#undef DISK_MEMBER

extern const struct disk *disk_calls;
void disk_use(const struct disk *calls); /* NULL: the system's functions */
extern const struct disk disk_system;

#define DISK_WRAPPER(result, name, parameters, arguments) \
	static inline result disk_##name parameters       \
	{                                                 \
		return disk_calls->name arguments;        \
	}
DISK_CALLS(DISK_WRAPPER)
#undef DISK_WRAPPER

/* Whether an error, -errno, says that there is no room on the disk, or none left of its quota. */
static inline bool disk_is_full(int code)
{
	return code == -ENOSPC || code == -EDQUOT;
}

/* The data need not stay in the page cache: it is read again only after a crash. */
static inline void disk_forget(int fd)
{
	posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
}

/* The file will be read sequentially and completely, soon. */
static inline void disk_read_through(int fd)
{
	posix_fadvise(fd, 0, 0, POSIX_FADV_SEQUENTIAL);
	posix_fadvise(fd, 0, 0, POSIX_FADV_WILLNEED);
}

/* Writes all of it; 0 or -errno. */
int disk_write_all(int fd, const void *bytes, size_t size);
/* Writes a file atomically: a new one under the name PATH.tmp, flushed, then renamed. Others may read it if the
 * mode says so, whatever the umask. Its name is durable once its folder is flushed. After an error the old file is
 * unchanged. */
int disk_replace(const char *path, const void *bytes, size_t size, mode_t mode, struct error *e);
/* Makes the names in a folder durable. */
int disk_sync_folder(const char *path, struct error *e);
/* Makes a folder, durably; it may exist already. */
int disk_make_folder(const char *path, struct error *e);

/* The names in a folder, except . and .., in no order. A folder may fail midway (EIO; ESTALE on NFS), and what was not
 * listed then is not missing: so every list ends with disk_list_end, which tells. Names may be removed meanwhile. */
struct disk_list {
	const char *path; /* not copied */
	DIR *d;
	int fault; /* errno; 0: none */
};
void disk_list_begin(struct disk_list *l, const char *path);
const char *disk_list_next(struct disk_list *l); /* valid until the next call; NULL: the end, or an error */
/* rc: what the caller met, which comes before an error of the folder. 0: each name was seen, or the caller stopped
 * before; otherwise rc, or -errno of the folder's first error. */
int disk_list_end(struct disk_list *l, int rc, struct error *e);

#endif
