/* SPDX-License-Identifier: Apache-2.0 */
/* Reads and writes all of it, whatever signals come. Not of files that must survive: disk.h. Any thread. */
#ifndef COMMON_BASE_IO_H
#define COMMON_BASE_IO_H

#include <stddef.h>
#include <sys/types.h>

/* 0; -errno, which is left in errno, too: only a part was written. */
int io_write_all(int fd, const void *bytes, size_t size);
/* The number of bytes; fewer than `size`: the file ends there. -errno */
ssize_t io_read_all(int fd, void *bytes, size_t size);

#endif
