/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A file that is believed as a whole or not at all: bytes, and the CRC-32C of them behind. Written to its end and
 * flushed before it gets its name; read through once and checked before anything in it is used. Any thread, one at a
 * time for a file. Numbers are in the byte order of the machine.
 */
#ifndef COMMON_BASE_CHECKED_FILE_H
#define COMMON_BASE_CHECKED_FILE_H

#include "common/base/error.h"

#include <stddef.h>
#include <stdint.h>

/* Hears of so many more bytes that were read. Not 0: no more is read, and the reading ends with this code. */
typedef int checked_file_progress(void *user, size_t bytes, struct error *e);

struct checked_file {
	int fd;
	uint32_t crc;
	unsigned char *buffer;		 /* NULL: the file is closed */
	size_t at, filled;		 /* in the buffer: reading; bytes of the file that are in it */
	uint64_t from;			 /* reading: the buffer's end in the file */
	uint64_t left, bytes;		 /* reading: until the CRC; writing: so far */
	const char *path;		 /* the caller's */
	checked_file_progress *progress; /* reading; NULL: nobody watches */
	void *user;
};

int checked_file_create(struct checked_file *s, const char *path, struct error *e);
int checked_file_write(struct checked_file *s, const void *bytes, size_t size, struct error *e);
/* Writes the CRC, flushes the file to the disk, closes it. */
int checked_file_finish(struct checked_file *s, struct error *e);

/* -EBADMSG: the CRC does not fit; -ENOENT. */
int checked_file_open(struct checked_file *s, const char *path, struct error *e);
/* The same; each byte is read twice in all, once to check it. */
int checked_file_open_watched(struct checked_file *s, const char *path, checked_file_progress *progress, void *user,
			      struct error *e);
int checked_file_read(struct checked_file *s, void *bytes, size_t size,
		      struct error *e);		 /* -EBADMSG: there is not so much */
void checked_file_close(struct checked_file *s); /* at any time; what was being written has no seal then */

#endif
