/* SPDX-License-Identifier: Apache-2.0 */
/* A disk with slow reads, for LD_PRELOAD: each piece of a job's journal takes HSLT_SLOW microseconds longer. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

ssize_t pread64(int fd, void *bytes, size_t size, off64_t at)
{
	char link[64], path[4096];
	const char *delay_us = getenv("HSLT_SLOW");
	snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
	ssize_t n = delay_us ? readlink(link, path, sizeof path - 1) : 0;
	path[n > 0 ? n : 0] = 0;
	if (strstr(path, "/journal."))
		usleep((useconds_t)atol(delay_us));
	return syscall(SYS_pread64, fd, bytes, size, at);
}

ssize_t pread(int fd, void *bytes, size_t size, off_t at)
{
	return pread64(fd, bytes, size, at);
}
