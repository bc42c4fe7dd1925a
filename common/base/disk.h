/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All file I/O of data that must survive a crash: the coordinator's spool, blob stores, film files, checked files. The
 * functions are the system's, with its conventions (-1 and errno), called through a table; tests replace the table by a
 * disk that is full, fails, or loses data that was not flushed. tests/lint/disk.sh checks that these files are accessed
 * in no other way; SQLite has its own layer (its VFS). Any thread; call disk_set_calls before there is more than one.
 * Allocates nothing.
 *
 * Flushing a file makes its bytes and its length durable; flushing its folder makes its name durable. A flush that
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
	X(int, stat, (const char *path, struct stat *st), (path, st)) /* like lstat: links are not followed */       \
	X(int, fstat, (int fd, struct stat *st), (fd, st))                                                           \
	X(int, touch, (const char *path), (path))                                                                    \
	X(int, flock, (int fd, int what), (fd, what))                                                                \
	X(DIR *, opendir, (const char *path), (path))                                                                \
	X(struct dirent *, readdir, (DIR * d), (d)) /* NULL: end of the folder, or errno is set (clear it first) */  \
	X(uint64_t, capacity, (const char *path), (path))  /* size of the file system in bytes, or 0 if not known */ \
	X(uint64_t, available, (const char *path), (path)) /* bytes that can still be written, or UINT64_MAX */

#define DISK_MEMBER(result, name, parameters, arguments) result(*name) parameters;
struct disk {
	DISK_CALLS(DISK_MEMBER)
};
#undef DISK_MEMBER

extern const struct disk *disk_calls;
void disk_set_calls(const struct disk *calls); /* NULL: the system's functions */
extern const struct disk disk_system;

#define DISK_WRAPPER(result, name, parameters, arguments) \
	static inline result disk_##name parameters       \
	{                                                 \
		return disk_calls->name arguments;        \
	}
DISK_CALLS(DISK_WRAPPER)
#undef DISK_WRAPPER

/* Returns whether `code`, a -errno, means that the disk is full or a quota is used up. */
static inline bool disk_is_full(int code)
{
	return code == -ENOSPC || code == -EDQUOT;
}

/* Advises the kernel to drop the file from the page cache: it is read again only after a crash. */
static inline void disk_drop_cache(int fd)
{
	posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
}

/* Advises the kernel that the whole file will soon be read, sequentially. */
static inline void disk_prefetch(int fd)
{
	posix_fadvise(fd, 0, 0, POSIX_FADV_SEQUENTIAL);
	posix_fadvise(fd, 0, 0, POSIX_FADV_WILLNEED);
}

/* Writes all `size` bytes, in several calls if necessary. Returns 0 or -errno. */
int disk_write_all(int fd, const void *bytes, size_t size);
/* Replaces a file atomically: writes PATH.tmp, flushes it and renames it. If `mode` grants anything to group or others,
 * the file gets exactly that mode, whatever the umask. The name is durable once the folder is flushed. After an error
 * the old file is unchanged. */
int disk_replace(const char *path, const void *bytes, size_t size, mode_t mode, struct error *e);
/* Makes the names in a folder durable. */
int disk_sync_folder(const char *path, struct error *e);
/* Makes a folder and its name durable; the folder may exist already. */
int disk_make_folder(const char *path, struct error *e);

/* Lists the names in a folder, except . and .., in no particular order. Reading a folder may fail midway (EIO; ESTALE
 * on NFS); a name that was not listed may exist nevertheless. Every list therefore ends with disk_list_end, which
 * reports such an error. Names may be removed while a list is open. */
struct disk_list {
	const char *path; /* not copied */
	DIR *dir;
	int first_errno; /* errno of the first error; 0: none */
};
void disk_list_begin(struct disk_list *l, const char *path);
/* Returns the next name, valid until the next call; NULL at the end or after an error. */
const char *disk_list_next(struct disk_list *l);
/* Ends the list. rc is the caller's own error, or 0. Returns rc if it is not 0, then -errno of the folder's first error
 * if there was one, otherwise 0. */
int disk_list_end(struct disk_list *l, int rc, struct error *e);

#endif
