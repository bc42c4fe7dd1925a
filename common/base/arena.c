/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/arena.h"

#include "common/base/mem.h"

#include <stdalign.h>
#include <stdint.h>
#include <string.h>

enum { ALIGNMENT = 64, BLOCK = 1 << 18 };

struct arena_block {
	struct arena_block *next;
	size_t size, used;
	char *bytes;
};

static char *aligned(char *p)
{
	return p + (-(uintptr_t)p & (ALIGNMENT - 1));
}

void *arena_alloc(struct arena *a, size_t count, size_t size)
{
	if (size && count > (SIZE_MAX / 4) / size)
		return NULL;
	size_t need = (count * size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
	if (need == 0)
		need = ALIGNMENT;
	if (a->limit && need > a->limit - (a->used < a->limit ? a->used : a->limit))
		return NULL;
	struct arena_block *b = a->blocks;
	if (!b || b->size - b->used < need) {
		size_t room = need > BLOCK ? need : BLOCK;
		b = mem_alloc(1, sizeof *b + room + ALIGNMENT);
		if (!b)
			return NULL;
		b->bytes = aligned((char *)(b + 1));
		b->size = room;
		/* A block for one large request goes second: later small requests still use the room in the first. */
		if (need > BLOCK && a->blocks) {
			b->next = a->blocks->next;
			a->blocks->next = b;
		} else {
			b->next = a->blocks;
			a->blocks = b;
		}
	}
	void *p = b->bytes + b->used;
	b->used += need;
	a->used += need;
	return p;
}

char *arena_strdup(struct arena *a, const char *s)
{
	size_t n = strlen(s) + 1;
	char *p = arena_alloc(a, n, 1);
	if (p)
		memcpy(p, s, n);
	return p;
}

void arena_fini(struct arena *a)
{
	for (struct arena_block *b = a->blocks, *next; b; b = next) {
		next = b->next;
		mem_free(b);
	}
	*a = (struct arena){0};
}
