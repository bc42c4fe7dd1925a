#include "common/base/buf.h"

#include "common/base/mem.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool buf_reserve(struct buf *b, size_t count)
{
	if (count > b->limit - b->size)
		return false;
	if (count <= b->capacity - b->size)
		return true;
	size_t want = b->capacity < 256 ? 256 : b->capacity;
	while (want - b->size < count)
		want = want > b->limit / 2 ? b->limit : want * 2;
	unsigned char *bytes = mem_grow(b->bytes, b->capacity, want);
	if (!bytes)
		return false;
	b->bytes = bytes;
	b->capacity = want;
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

bool buf_print(struct buf *b, const char *format, ...)
{
	va_list ap, again;
	va_start(ap, format);
	va_copy(again, ap);
	int n = vsnprintf(NULL, 0, format, ap);
	va_end(ap);
	bool ok = n >= 0 && buf_reserve(b, (size_t)n + 1);
	if (ok) {
		vsnprintf((char *)b->bytes + b->size, (size_t)n + 1, format, again);
		b->size += (size_t)n;
	}
	va_end(again);
	return ok;
}

void buf_fini(struct buf *b)
{
	mem_free(b->bytes);
	b->bytes = NULL;
	b->size = b->capacity = 0;
}
