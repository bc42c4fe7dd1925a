/* SPDX-License-Identifier: Apache-2.0 */
/* Reads and writes that continue after signals and partial transfers. Files that must survive a crash use disk.h
 * instead. Any thread. */
#ifndef COMMON_BASE_IO_H
#define COMMON_BASE_IO_H

#include <stddef.h>
#include <sys/types.h>

/* Returns 0, or -errno if not all bytes could be written; errno is set, too. */
int io_write_all(int fd, const void *bytes, size_t size);
/* Returns the number of bytes read, fewer than `size` only at the end of the file, or -errno. */
ssize_t io_read_all(int fd, void *bytes, size_t size);

#endif
