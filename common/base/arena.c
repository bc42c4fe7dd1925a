/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/arena.h"

#include "common/base/fnv.h"
#include "common/base/mem.h"

#include <stdalign.h>
#include <stdbool.h>
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

/* A hash table with open addressing, in the arena; it doubles when it is half full. */
struct arena_shares {
	size_t room, count; /* room: a power of two */
	struct arena_share **at;
};

enum { SHARES_FIRST = 64, SHARE_SAMPLES = 32, SHARE_TRIES = 8 };

/* Of the size and of parts of the bytes: whether they are equal is compared, but for few. */
static size_t share_hash(const void *bytes, size_t size)
{
	const char *p = bytes;
	uint64_t h = fnv_add(FNV_BEGIN, &size, sizeof size);
	if (size <= SHARE_SAMPLES * sizeof h)
		return (size_t)fnv_add(h, p, size);
	for (size_t i = 0; i < SHARE_SAMPLES; i++)
		h = fnv_add(h, p + (size - sizeof h) / (SHARE_SAMPLES - 1) * i, sizeof h);
	return (size_t)fnv_add(h, p + size - sizeof h, sizeof h);
}

static struct arena_share **free_place(const struct arena_shares *s, size_t hash)
{
	size_t i = hash & (s->room - 1);
	while (s->at[i])
		i = (i + 1) & (s->room - 1);
	return &s->at[i];
}

static bool make_room(struct arena *a)
{
	struct arena_shares *old = a->shares;
	if (old && 2 * old->count < old->room)
		return true;
	struct arena_shares *s = arena_alloc(a, 1, sizeof *s);
	if (!s)
		return false;
	s->room = old ? 2 * old->room : SHARES_FIRST;
	s->count = old ? old->count : 0;
	s->at = arena_alloc(a, s->room, sizeof(struct arena_share *));
	if (!s->at)
		return false;
	for (size_t i = 0; old && i < old->room; i++)
		if (old->at[i])
			*free_place(s, share_hash(old->at[i]->bytes, old->at[i]->size)) = old->at[i];
	a->shares = s;
	return true;
}

struct arena_share *arena_share(struct arena *a, const void *bytes, size_t size)
{
	size_t hash = share_hash(bytes, size);
	if (a->shares) {
		const struct arena_shares *s = a->shares;
		size_t i = hash & (s->room - 1);
		for (int tries = 0; s->at[i] && tries < SHARE_TRIES; i = (i + 1) & (s->room - 1), tries++)
			if (s->at[i]->size == size && (size == 0 || memcmp(s->at[i]->bytes, bytes, size) == 0))
				return s->at[i];
	}
	if (!make_room(a))
		return NULL;
	struct arena_share *new = arena_alloc(a, 1, sizeof *new);
	void *copy = new ? arena_alloc(a, size, 1) : NULL;
	if (!copy)
		return NULL;
	if (size)
		memcpy(copy, bytes, size);
	*new = (struct arena_share){.bytes = copy, .size = size};
	*free_place(a->shares, hash) = new;
	a->shares->count++;
	return new;
}

void arena_fini(struct arena *a)
{
	for (struct arena_block *b = a->blocks, *next; b; b = next) {
		next = b->next;
		mem_free(b);
	}
	*a = (struct arena){0};
}
