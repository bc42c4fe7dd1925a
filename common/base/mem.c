/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/mem.h"

#include <limits.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>

void *mem_alloc(size_t count, size_t size)
{
	return calloc(count ? count : 1, size ? size : 1);
}

void *mem_grow(void *p, size_t old_size, size_t new_size)
{
	char *q = realloc(p, new_size ? new_size : 1);
	if (q && new_size > old_size)
		memset(q + old_size, 0, new_size - old_size);
	return q;
}

char *mem_strdup(const char *s)
{
	size_t n = strlen(s) + 1;
	char *p = malloc(n);
	if (p)
		memcpy(p, s, n);
	return p;
}

void mem_free(void *p)
{
	free(p);
}

void mem_retain_freed(size_t bytes)
{
	enum { MMAP_THRESHOLD_MAX = 32 << 20 }; /* glibc's maximum */
	int limit = bytes < INT_MAX ? (int)bytes : INT_MAX;
	mallopt(M_TRIM_THRESHOLD, limit);
	mallopt(M_MMAP_THRESHOLD, limit < MMAP_THRESHOLD_MAX ? limit : MMAP_THRESHOLD_MAX);
}
