/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Memory that lives and dies together: one arena per scene description, one per world.
 * Not safe for two threads at once. Zeroed; aligned to 64 bytes.
 */
#ifndef COMMON_BASE_ARENA_H
#define COMMON_BASE_ARENA_H

#include <stddef.h>

struct arena_block;
struct arena {
	struct arena_block *blocks;
	size_t used;  /* bytes handed out */
	size_t limit; /* 0: none; else arena_alloc returns NULL beyond it */
};

void *arena_alloc(struct arena *a, size_t count, size_t size); /* NULL when memory or the limit is out */
char *arena_strdup(struct arena *a, const char *s);
void arena_fini(struct arena *a);

#endif
