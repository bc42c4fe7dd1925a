/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A file with a CRC-32C at its end. Writers write and flush it under a temporary name and rename it; opening it for
 * reading checks the whole file before any of its contents is used. Any thread, but one at a time per file.
 *
 * offset    bytes  contents
 * 0         N      the bytes written, in order
 * N         4      CRC-32C of these N bytes
 *
 * Numbers are little endian, on any machine (bytes.h).
 */
#ifndef COMMON_BASE_CHECKED_FILE_H
#define COMMON_BASE_CHECKED_FILE_H

#include "common/base/error.h"

#include <stddef.h>
#include <stdint.h>

/* Called with the number of bytes just read. A result other than 0 ends the reading with that code. */
typedef int checked_file_progress(void *user, size_t bytes, struct error *e);

struct checked_file {
	int fd;
	uint32_t crc;
	unsigned char *buffer;		 /* NULL: the file is closed */
	size_t buffer_offset;		 /* reading: offset of the next byte in the buffer */
	size_t buffered_bytes;		 /* bytes in the buffer */
	uint64_t file_offset;		 /* reading: offset in the file of the byte after the buffer's last */
	uint64_t remaining_bytes;	 /* reading: bytes before the CRC that have not been read yet */
	uint64_t bytes_written;		 /* writing */
	const char *path;		 /* not copied; must last as long as the file is open */
	checked_file_progress *progress; /* called while reading; NULL: none */
	void *user;
};

/* Creates or truncates the file at `path`. Functions return 0 or -errno; after an error of a write, call
 * checked_file_close. */
int checked_file_create(struct checked_file *s, const char *path, struct error *e);
int checked_file_write(struct checked_file *s, const void *bytes, size_t size, struct error *e);
/* Writes an array of integers or floating point numbers of `width` bytes each: 1, 2, 4 or 8. */
int checked_file_write_numbers(struct checked_file *s, const void *numbers, size_t width, size_t count,
			       struct error *e);
/* Writes the CRC and flushes the file. Closes it in any case. */
int checked_file_finish(struct checked_file *s, struct error *e);

/* Opens a file for reading, after it has read all of it and compared the CRC. Returns -EBADMSG if the CRC does not
 * match, -ENOENT if there is no such file, or another -errno. */
int checked_file_open(struct checked_file *s, const char *path, struct error *e);
/* Like checked_file_open, but `progress` is told of all bytes read, each of them twice: the check reads the whole file
 * first. */
int checked_file_open_with_progress(struct checked_file *s, const char *path, checked_file_progress *progress,
				    void *user, struct error *e);
/* Reads the next `size` bytes; -EBADMSG if the file has fewer. */
int checked_file_read(struct checked_file *s, void *bytes, size_t size, struct error *e);
int checked_file_read_numbers(struct checked_file *s, void *numbers, size_t width, size_t count, struct error *e);
/* Checks that all bytes have been read; -EBADMSG if some are left. */
int checked_file_expect_end(const struct checked_file *s, struct error *e);
/* May be called at any time, also twice. A file that was being written is left without a CRC. */
void checked_file_close(struct checked_file *s);

#endif
