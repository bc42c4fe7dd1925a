/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The one door for file I/O of whatever must survive: the coordinator's spool, stores of blobs, files of films, sealed
 * files. The calls are the system's, with its conventions (-1 and errno), through a table that tests replace: by a disk
 * that is full, fails, or forgets at a loss of power what was not flushed. tests/lint/disk.sh holds the tree to it;
 * SQLite has a door of its own (its VFS). Any thread; disk_use before there is more than one. Allocates nothing.
 *
 * What a flush promises: the bytes and the length of this file. That its name is there is promised by a flush of its
 * folder. A flush that failed is never repeated: what it did not write may be forgotten, and the next one says that all
 * is well.
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
	int (*posix_fallocate)(int fd, off_t at, off_t size); /* the error is what it returns */
	int (*fsync)(int fd);
	int (*fdatasync)(int fd);
	int (*rename)(const char *from, const char *to);
	int (*unlink)(const char *path);
	int (*mkdir)(const char *path, mode_t mode);
	int (*rmdir)(const char *path);
	int (*stat)(const char *path, struct stat *st); /* of a link: the link's */
	int (*fstat)(int fd, struct stat *st);
	int (*touch)(const char *path);
	int (*flock)(int fd, int what);
	DIR *(*opendir)(const char *path);
};

extern const struct disk *disk_calls;
void disk_use(const struct disk *calls); /* NULL: the system's */
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

/* What is on the disk need not stay in memory: it is read again after a crash only. */
static inline void disk_forget(int fd)
{
	posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
}

/* All of it will be read, from its beginning to its end, and soon. */
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

/* All of it; 0 or -errno. */
int disk_write_all(int fd, const void *bytes, size_t size);
/* The names in a folder are there for good. */
int disk_sync_folder(const char *path, struct error *e);
/* The folder is there, for good; it may have been before. */
int disk_make_folder(const char *path, struct error *e);

#endif
