/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/buf.h"

#include "common/base/mem.h"

#include <string.h>

bool buf_reserve(struct buf *b, size_t count)
{
	if (count > b->limit - b->size)
		return false;
	if (count <= b->capacity - b->size)
		return true;
	size_t new_capacity = b->capacity < 256 ? 256 : b->capacity;
	while (new_capacity - b->size < count)
		new_capacity = new_capacity > b->limit / 2 ? b->limit : new_capacity * 2;
	unsigned char *bytes = mem_grow(b->bytes, b->capacity, new_capacity);
	if (!bytes)
		return false;
	b->bytes = bytes;
	b->capacity = new_capacity;
	return true;
}

bool buf_append(struct buf *b, const void *bytes, size_t count)
{
	if (!buf_reserve(b, count))
		return false;
	if (count)
		memcpy(b->bytes + b->size, bytes, count);
	b->size += count;
	return true;
}

void buf_fini(struct buf *b)
{
	mem_free(b->bytes);
	b->bytes = NULL;
	b->size = b->capacity = 0;
}
