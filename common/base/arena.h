/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An arena: memory that is freed all at once. Each scene description has one, and each world. Not thread-safe.
 * Memory is zeroed and aligned to 64 bytes.
 */
#ifndef COMMON_BASE_ARENA_H
#define COMMON_BASE_ARENA_H

#include <stddef.h>

struct arena_block;
struct arena_intern_table;
struct arena {
	struct arena_block *blocks;
	size_t used;				 /* bytes handed out */
	size_t limit;				 /* bytes that may be handed out at most; 0: unlimited */
	struct arena_intern_table *intern_table; /* NULL: nothing is shared */
};

/* Returns room for `count` items of `size` bytes; NULL if memory is out or the limit is reached. */
void *arena_alloc(struct arena *a, size_t count, size_t size);
/* Returns a copy of s; NULL as for arena_alloc. */
char *arena_strdup(struct arena *a, const char *s);

/* Bytes that the arena holds once, however often arena_intern is called with them. They must not be changed. */
struct arena_interned {
	const void *bytes;
	size_t size;
	void *user; /* for the caller's use; NULL at first */
};
/* Returns a copy of the bytes, or an earlier copy of equal ones; among very many copies that differ in few bytes only
 * some are found. NULL as for arena_alloc. */
struct arena_interned *arena_intern(struct arena *a, const void *bytes, size_t size);

/* Frees all blocks; the arena is then empty and has no limit. */
void arena_fini(struct arena *a);

#endif
