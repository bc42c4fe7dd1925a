/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An arena: memory that is freed all at once, one for each scene description and one for each world. Not thread-safe.
 * Memory is zeroed and aligned to 64 bytes.
 */
#ifndef COMMON_BASE_ARENA_H
#define COMMON_BASE_ARENA_H

#include <stddef.h>

struct arena_block;
struct arena {
	struct arena_block *blocks;
	size_t used;  /* bytes handed out */
	size_t limit; /* 0: unlimited; otherwise arena_alloc returns NULL beyond it */
};

void *arena_alloc(struct arena *a, size_t count, size_t size); /* NULL: out of memory, or the limit is reached */
char *arena_strdup(struct arena *a, const char *s);
void arena_fini(struct arena *a);

#endif
