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

struct slot {
	size_t hash;
	struct arena_share *share; /* NULL: free */
};

/* A hash table with open addressing, in the arena; it doubles when it is half full. It may miss some of what is
 * shared: a search takes at most SHARE_STEPS steps and compares the bytes of SHARE_ALIKE entries, so that bytes chosen
 * to have one hash take no time that grows with their number. */
struct arena_shares {
	size_t room, count; /* room: a power of two */
	struct slot *at;
};

enum { SHARES_FIRST = 64, SHARE_SAMPLES = 32, SHARE_ALIKE = 8, SHARE_STEPS = 256 };

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

/* Adds an entry, unless the place where it would be searched is full. */
static void add(struct arena_shares *s, size_t hash, struct arena_share *share)
{
	for (size_t k = 0; k < SHARE_STEPS; k++) {
		struct slot *at = &s->at[(hash + k) & (s->room - 1)];
		if (at->share)
			continue;
		*at = (struct slot){hash, share};
		s->count++;
		return;
	}
}

/* Returns the entry with these bytes, or NULL. *full: so many entries have this hash that another is not added. */
static struct arena_share *find(const struct arena_shares *s, size_t hash, const void *bytes, size_t size, bool *full)
{
	size_t alike = 0;
	for (size_t k = 0; k < SHARE_STEPS && alike < SHARE_ALIKE; k++) {
		const struct slot *at = &s->at[(hash + k) & (s->room - 1)];
		if (!at->share)
			break;
		if (at->hash != hash)
			continue;
		if (at->share->size == size && (size == 0 || memcmp(at->share->bytes, bytes, size) == 0))
			return at->share;
		alike++;
	}
	*full = alike == SHARE_ALIKE;
	return NULL;
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
	s->count = 0;
	s->at = arena_alloc(a, s->room, sizeof *s->at);
	if (!s->at)
		return false;
	for (size_t i = 0; old && i < old->room; i++)
		if (old->at[i].share)
			add(s, old->at[i].hash, old->at[i].share);
	a->shares = s;
	return true;
}

struct arena_share *arena_share(struct arena *a, const void *bytes, size_t size)
{
	size_t hash = share_hash(bytes, size);
	bool full = false;
	struct arena_share *known = a->shares ? find(a->shares, hash, bytes, size, &full) : NULL;
	if (known)
		return known;
	if (!make_room(a))
		return NULL;
	struct arena_share *new = arena_alloc(a, 1, sizeof *new);
	void *copy = new ? arena_alloc(a, size, 1) : NULL;
	if (!copy)
		return NULL;
	if (size)
		memcpy(copy, bytes, size);
	*new = (struct arena_share){.bytes = copy, .size = size};
	if (!full)
		add(a->shares, hash, new);
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
