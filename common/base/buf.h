/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A byte buffer that grows up to a hard limit. Not thread-safe. Zeroed memory with `limit` set is an empty buffer.
 */
#ifndef COMMON_BASE_BUF_H
#define COMMON_BASE_BUF_H

#include <stdbool.h>
#include <stddef.h>

struct buf {
	unsigned char *bytes;
	size_t size, capacity;
	size_t limit; /* the buffer never holds more */
};

/* Makes room for `count` more bytes. Returns false if they would exceed the limit or memory is out; the buffer is then
 * unchanged. */
bool buf_reserve(struct buf *b, size_t count);
/* Appends `count` bytes; false as for buf_reserve. */
bool buf_append(struct buf *b, const void *bytes, size_t count);
/* Frees the bytes. The buffer is empty then, keeps its limit and can be used again. */
void buf_fini(struct buf *b);

#endif
