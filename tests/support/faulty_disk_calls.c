/* SPDX-License-Identifier: Apache-2.0 */
/* The calls of common/base/disk.h: each determines whether it is to fail, makes the real call, and records its
 * changes. */
#include "tests/support/faulty_disk.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

enum { FDS_MAX = 4096 };
static struct faulty_disk_node *nodes_by_fd[FDS_MAX];

static bool is_refused(enum faulty_disk_call kind)
{
	int code = faulty_disk_begin_call(kind);
	if (!code)
		return false;
	faulty_disk_end_call();
	errno = code;
	return true;
}

/* Preserves errno. */
static long end_call_with(long result)
{
	faulty_disk_end_call();
	return result;
}

static int do_open(const char *path, int flags, mode_t mode)
{
	bool hidden = (flags & O_TMPFILE) == O_TMPFILE, changes = !hidden && (flags & (O_CREAT | O_TRUNC));
	if (is_refused(changes ? FAULTY_DISK_OPEN : FAULTY_DISK_READ))
		return -1;
	int fd = open(path, flags, mode);
	if (fd >= 0 && fd < FDS_MAX)
		nodes_by_fd[fd] = hidden ? NULL : faulty_disk_find_node(path, (flags & O_CREAT) != 0);
	if (fd >= 0 && fd < FDS_MAX && nodes_by_fd[fd] && (flags & O_TRUNC))
		faulty_disk_record_truncate(nodes_by_fd[fd], 0);
	return (int)end_call_with(fd);
}

static int do_close(int fd)
{
	faulty_disk_begin_call(FAULTY_DISK_READ); /* a failed close closes all the same */
	if (fd >= 0 && fd < FDS_MAX)
		nodes_by_fd[fd] = NULL;
	return (int)end_call_with(close(fd));
}

static struct faulty_disk_node *fd_node(int fd)
{
	return fd >= 0 && fd < FDS_MAX ? nodes_by_fd[fd] : NULL;
}

static ssize_t do_read(int fd, void *bytes, size_t size)
{
	return is_refused(FAULTY_DISK_READ) ? -1 : end_call_with(read(fd, bytes, size));
}

static ssize_t do_pread(int fd, void *bytes, size_t size, off_t at)
{
	return is_refused(FAULTY_DISK_READ) ? -1 : end_call_with(pread(fd, bytes, size, at));
}

static ssize_t do_write(int fd, const void *bytes, size_t size)
{
	if (is_refused(FAULTY_DISK_WRITE))
		return -1;
	bool at_end = fcntl(fd, F_GETFL) & O_APPEND;
	off_t at = lseek(fd, 0, at_end ? SEEK_END : SEEK_CUR);
	ssize_t n = write(fd, bytes, size);
	if (n > 0)
		faulty_disk_record_write(fd_node(fd), bytes, (size_t)n, (uint64_t)at);
	return end_call_with(n);
}

static ssize_t do_pwritev(int fd, const struct iovec *parts, int count, off_t at)
{
	if (is_refused(FAULTY_DISK_WRITE))
		return -1;
	ssize_t n = pwritev(fd, parts, count, at);
	for (size_t remaining = n > 0 ? (size_t)n : 0; remaining; parts++) {
		size_t size = parts->iov_len < remaining ? parts->iov_len : remaining;
		faulty_disk_record_write(fd_node(fd), parts->iov_base, size, (uint64_t)at);
		at += (off_t)size;
		remaining -= size;
	}
	return end_call_with(n);
}

static int do_ftruncate(int fd, off_t size)
{
	if (is_refused(FAULTY_DISK_REMOVE))
		return -1;
	int rc = ftruncate(fd, size);
	if (!rc)
		faulty_disk_record_truncate(fd_node(fd), (uint64_t)size);
	return (int)end_call_with(rc);
}

static int do_fallocate(int fd, int mode, off_t at, off_t size)
{
	assert(mode == FALLOC_FL_KEEP_SIZE);
	return is_refused(FAULTY_DISK_WRITE) ? -1 : (int)end_call_with(fallocate(fd, mode, at, size));
}

static int do_posix_fallocate(int fd, off_t at, off_t size)
{
	int code = faulty_disk_begin_call(FAULTY_DISK_WRITE);
	return (int)end_call_with(code ? code : posix_fallocate(fd, at, size));
}

static int do_fsync(int fd)
{
	int code = faulty_disk_begin_call(FAULTY_DISK_FLUSH);
	if (code)
		faulty_disk_record_failed_flush(fd_node(fd));
	else
		faulty_disk_record_flush(fd_node(fd), false);
	faulty_disk_end_call();
	errno = code;
	return code ? -1 : 0;
}

static int do_rename(const char *from, const char *to)
{
	if (is_refused(FAULTY_DISK_OPEN))
		return -1;
	int rc = rename(from, to);
	if (!rc)
		faulty_disk_record_rename(from, to);
	return (int)end_call_with(rc);
}

static int do_unlink(const char *path)
{
	if (is_refused(FAULTY_DISK_REMOVE))
		return -1;
	int rc = unlink(path);
	if (!rc)
		faulty_disk_record_removal(path);
	return (int)end_call_with(rc);
}

static int do_mkdir(const char *path, mode_t mode)
{
	if (is_refused(FAULTY_DISK_OPEN))
		return -1;
	int rc = mkdir(path, mode);
	if (!rc)
		faulty_disk_record_new_folder(path);
	return (int)end_call_with(rc);
}

static int do_rmdir(const char *path)
{
	if (is_refused(FAULTY_DISK_REMOVE))
		return -1;
	int rc = rmdir(path);
	if (!rc)
		faulty_disk_record_removal(path);
	return (int)end_call_with(rc);
}

static int do_stat(const char *path, struct stat *st)
{
	return is_refused(FAULTY_DISK_READ) ? -1 : (int)end_call_with(lstat(path, st));
}

static int do_fstat(int fd, struct stat *st)
{
	return is_refused(FAULTY_DISK_READ) ? -1 : (int)end_call_with(fstat(fd, st));
}

static int do_touch(const char *path)
{
	return is_refused(FAULTY_DISK_READ) ? -1 : (int)end_call_with(disk_system.touch(path));
}

static int do_flock(int fd, int operation)
{
	return is_refused(FAULTY_DISK_READ) ? -1 : (int)end_call_with(disk_system.flock(fd, operation));
}

static DIR *do_opendir(const char *path)
{
	if (is_refused(FAULTY_DISK_READ))
		return NULL;
	DIR *d = opendir(path);
	faulty_disk_end_call();
	return d;
}

static struct dirent *do_readdir(DIR *d)
{
	if (is_refused(FAULTY_DISK_READ))
		return NULL;
	struct dirent *f = readdir(d);
	faulty_disk_end_call();
	return f;
}

static uint64_t do_capacity(const char *path)
{
	(void)path;
	return 0;
}

static uint64_t do_available(const char *path)
{
	(void)path;
	return UINT64_MAX;
}

const struct disk faulty_disk_calls = {
	do_open,    do_close,	  do_read,	do_pread,	    do_write,
	do_pwritev, do_ftruncate, do_fallocate, do_posix_fallocate, do_fsync,
	do_fsync,   do_rename,	  do_unlink,	do_mkdir,	    do_rmdir,
	do_stat,    do_fstat,	  do_touch,	do_flock,	    do_opendir,
	do_readdir, do_capacity,  do_available,
};
