/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A file with a CRC-32C at its end. It is written completely and flushed before it gets its name; a reader checks all
 * of it before it uses any of it. Any thread, but one at a time per file.
 *
 * offset    bytes  contents
 * 0         N      what was written, in order
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
	size_t at, filled;		 /* in the buffer: bytes of the file, when reading */
	uint64_t from;			 /* reading: the buffer's end in the file */
	uint64_t left, bytes;		 /* reading: up to the CRC; writing: so far */
	const char *path;		 /* the caller's */
	checked_file_progress *progress; /* when reading; NULL: none */
	void *user;
};

int checked_file_create(struct checked_file *s, const char *path, struct error *e);
int checked_file_write(struct checked_file *s, const void *bytes, size_t size, struct error *e);
/* An array of integers or floating point numbers of `width` bytes each: 1, 2, 4 or 8. */
int checked_file_write_numbers(struct checked_file *s, const void *numbers, size_t width, size_t count,
			       struct error *e);
/* Writes the CRC, flushes the file and closes it. */
int checked_file_finish(struct checked_file *s, struct error *e);

/* -EBADMSG: the CRC does not match; -ENOENT. */
int checked_file_open(struct checked_file *s, const char *path, struct error *e);
/* The same; every byte is read twice, once for the check. */
int checked_file_open_watched(struct checked_file *s, const char *path, checked_file_progress *progress, void *user,
			      struct error *e);
/* -EBADMSG: the file has fewer bytes. */
int checked_file_read(struct checked_file *s, void *bytes, size_t size, struct error *e);
int checked_file_read_numbers(struct checked_file *s, void *numbers, size_t width, size_t count, struct error *e);
/* -EBADMSG: bytes are left that nothing has read. */
int checked_file_end(const struct checked_file *s, struct error *e);
void checked_file_close(struct checked_file *s); /* at any time; a file that was being written is left without a CRC */

#endif
