/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A text file that is built in memory and written atomically. Lack of memory is reported once, at the end. One thread;
 * zeroed memory is an empty file.
 */
#ifndef WORKER_CLI_BASE_TEXT_FILE_H
#define WORKER_CLI_BASE_TEXT_FILE_H

#include "common/base/buf.h"
#include "common/base/error.h"

struct text_file {
	struct buf text;
	bool has_failed; /* memory was out, or a line too long: text_file_write will fail */
};

__attribute__((format(printf, 2, 3))) void text_file_put(struct text_file *p, const char *format, ...);
void text_file_put_bytes(struct text_file *p, const void *bytes, size_t count);
/* Appends text to XML or HTML: special characters are escaped; invalid UTF-8 and characters that XML does not allow
 * become '?'. */
void text_file_put_escaped(struct text_file *p, const char *text);
/* Appends a field of comma-separated values, in quotes if necessary. */
void text_file_put_field(struct text_file *p, const char *text);
void text_file_put_base64(struct text_file *p, const unsigned char *bytes, size_t count);
/* Writes the file atomically. Returns -ENOMEM if any text could not be appended, or an error of image_file_write. */
int text_file_write(const struct text_file *p, const char *path, struct error *e);
void text_file_fini(struct text_file *p);

/* Returns the bytes of the character at `at`, if it is valid UTF-8 and allowed in XML; otherwise 0. */
size_t text_file_character_length(const char *at);

#endif
