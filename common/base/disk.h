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
#include <stddef.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>

struct disk {
	int (*open)(const char *path, int flags, mode_t mode);
	int (*close)(int fd);
	ssize_t (*read)(int fd, void *bytes, size_t size);
	ssize_t (*pread)(int fd, void *bytes, size_t size, off_t at);
	ssize_t (*write)(int fd, const void *bytes, size_t size);
	ssize_t (*pwritev)(int fd, const struct iovec *parts, int count, off_t at);
	int (*ftruncate)(int fd, off_t size);
	int (*fallocate)(int fd, int mode, off_t at, off_t size);
	int (*posix_fallocate)(int fd, off_t at, off_t size); /* returns the error code */
	int (*fsync)(int fd);
	int (*fdatasync)(int fd);
	int (*rename)(const char *from, const char *to);
	int (*unlink)(const char *path);
	int (*mkdir)(const char *path, mode_t mode);
	int (*rmdir)(const char *path);
	int (*stat)(const char *path, struct stat *st); /* of the link itself */
	int (*fstat)(int fd, struct stat *st);
	int (*touch)(const char *path);
	int (*flock)(int fd, int what);
	DIR *(*opendir)(const char *path);
};

extern const struct disk *disk_calls;
void disk_use(const struct disk *calls); /* NULL: the system's functions */
extern const struct disk disk_system;

static inline int disk_open(const char *path, int flags, mode_t mode)
{
	return disk_calls->open(path, flags, mode);
}

static inline int disk_close(int fd)
{
	return disk_calls->close(fd);
}

static inline ssize_t disk_read(int fd, void *bytes, size_t size)
{
	return disk_calls->read(fd, bytes, size);
}

static inline ssize_t disk_pread(int fd, void *bytes, size_t size, off_t at)
{
	return disk_calls->pread(fd, bytes, size, at);
}

static inline ssize_t disk_write(int fd, const void *bytes, size_t size)
{
	return disk_calls->write(fd, bytes, size);
}

static inline ssize_t disk_pwritev(int fd, const struct iovec *parts, int count, off_t at)
{
	return disk_calls->pwritev(fd, parts, count, at);
}

static inline int disk_ftruncate(int fd, off_t size)
{
	return disk_calls->ftruncate(fd, size);
}

static inline int disk_fallocate(int fd, int mode, off_t at, off_t size)
{
	return disk_calls->fallocate(fd, mode, at, size);
}

static inline int disk_posix_fallocate(int fd, off_t at, off_t size)
{
	return disk_calls->posix_fallocate(fd, at, size);
}

static inline int disk_fsync(int fd)
{
	return disk_calls->fsync(fd);
}

static inline int disk_fdatasync(int fd)
{
	return disk_calls->fdatasync(fd);
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

static inline int disk_rename(const char *from, const char *to)
{
	return disk_calls->rename(from, to);
}

static inline int disk_unlink(const char *path)
{
	return disk_calls->unlink(path);
}

static inline int disk_mkdir(const char *path, mode_t mode)
{
	return disk_calls->mkdir(path, mode);
}

static inline int disk_rmdir(const char *path)
{
	return disk_calls->rmdir(path);
}

static inline int disk_stat(const char *path, struct stat *st)
{
	return disk_calls->stat(path, st);
}

static inline int disk_fstat(int fd, struct stat *st)
{
	return disk_calls->fstat(fd, st);
}

static inline int disk_touch(const char *path)
{
	return disk_calls->touch(path);
}

static inline int disk_flock(int fd, int what)
{
	return disk_calls->flock(fd, what);
}

static inline DIR *disk_opendir(const char *path)
{
	return disk_calls->opendir(path);
}

/* Writes all of it; 0 or -errno. */
int disk_write_all(int fd, const void *bytes, size_t size);
/* Writes a file atomically: under the name PATH.tmp, flushed, then renamed. Its name is durable once its folder is
 * flushed. After an error the old file is unchanged. */
int disk_replace(const char *path, const void *bytes, size_t size, mode_t mode, struct error *e);
/* Makes the names in a folder durable. */
int disk_sync_folder(const char *path, struct error *e);
/* Makes a folder, durably; it may exist already. */
int disk_make_folder(const char *path, struct error *e);

#endif
