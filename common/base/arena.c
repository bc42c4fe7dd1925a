/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/arena.h"

#include "common/base/fnv.h"
#include "common/base/mem.h"

#include <stdalign.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { ALIGNMENT = 64, BLOCK_BYTES = 1 << 18 };

struct arena_block {
	struct arena_block *next;
	size_t size, used;
	char *bytes;
};

static char *align_up(char *p)
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
		size_t capacity = need > BLOCK_BYTES ? need : BLOCK_BYTES;
		b = mem_alloc(1, sizeof *b + capacity + ALIGNMENT);
		if (!b)
			return NULL;
		b->bytes = align_up((char *)(b + 1));
		b->size = capacity;
		/* A block for one large request goes second: later small requests still use the room in the first. */
		if (need > BLOCK_BYTES && a->blocks) {
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

struct intern_slot {
	size_t hash;
	struct arena_interned *interned; /* NULL: free */
};

/* A hash table with open addressing, in the arena; it doubles when it is half full. It may miss some of what is
 * shared: a search takes at most INTERN_PROBES_MAX steps and compares the bytes of INTERN_COMPARES_MAX entries, so that
 * bytes chosen to have one hash take no time that grows with their number. */
struct arena_intern_table {
	size_t capacity, count; /* capacity: a power of two */
	struct intern_slot *slots;
};

enum { INTERN_SLOTS_INITIAL = 64, INTERN_SAMPLES = 32, INTERN_COMPARES_MAX = 8, INTERN_PROBES_MAX = 256 };

/* Of the size and of parts of the bytes: whether they are equal is compared, but for few. */
static size_t intern_hash(const void *bytes, size_t size)
{
	const char *p = bytes;
	uint64_t h = fnv_add(FNV_OFFSET_BASIS, &size, sizeof size);
	if (size <= INTERN_SAMPLES * sizeof h)
		return (size_t)fnv_add(h, p, size);
	for (size_t i = 0; i < INTERN_SAMPLES; i++)
		h = fnv_add(h, p + (size - sizeof h) / (INTERN_SAMPLES - 1) * i, sizeof h);
	return (size_t)fnv_add(h, p + size - sizeof h, sizeof h);
}

/* Adds an entry, unless the place where it would be searched is full. */
static void insert_interned(struct arena_intern_table *s, size_t hash, struct arena_interned *share)
{
	for (size_t k = 0; k < INTERN_PROBES_MAX; k++) {
		struct intern_slot *slot = &s->slots[(hash + k) & (s->capacity - 1)];
		if (slot->interned)
			continue;
		*slot = (struct intern_slot){hash, share};
		s->count++;
		return;
	}
}

/* Returns the entry with these bytes, or NULL. *full: so many entries have this hash that another is not added. */
static struct arena_interned *find_interned(const struct arena_intern_table *s, size_t hash, const void *bytes,
					    size_t size, bool *full)
{
	size_t equal_hashes = 0;
	for (size_t k = 0; k < INTERN_PROBES_MAX && equal_hashes < INTERN_COMPARES_MAX; k++) {
		const struct intern_slot *slot = &s->slots[(hash + k) & (s->capacity - 1)];
		if (!slot->interned)
			break;
		if (slot->hash != hash)
			continue;
		if (slot->interned->size == size && (size == 0 || memcmp(slot->interned->bytes, bytes, size) == 0))
			return slot->interned;
		equal_hashes++;
	}
	*full = equal_hashes == INTERN_COMPARES_MAX;
	return NULL;
}

static bool grow_intern_table(struct arena *a)
{
	struct arena_intern_table *old = a->intern_table;
	if (old && 2 * old->count < old->capacity)
		return true;
	struct arena_intern_table *s = arena_alloc(a, 1, sizeof *s);
	if (!s)
		return false;
	s->capacity = old ? 2 * old->capacity : INTERN_SLOTS_INITIAL;
	s->count = 0;
	s->slots = arena_alloc(a, s->capacity, sizeof *s->slots);
	if (!s->slots)
		return false;
	for (size_t i = 0; old && i < old->capacity; i++)
		if (old->slots[i].interned)
			insert_interned(s, old->slots[i].hash, old->slots[i].interned);
	a->intern_table = s;
	return true;
}

struct arena_interned *arena_intern(struct arena *a, const void *bytes, size_t size)
{
	size_t hash = intern_hash(bytes, size);
	bool full = false;
	struct arena_interned *existing =
		a->intern_table ? find_interned(a->intern_table, hash, bytes, size, &full) : NULL;
	if (existing)
		return existing;
	if (!grow_intern_table(a))
		return NULL;
	struct arena_interned *new = arena_alloc(a, 1, sizeof *new);
	void *copy = new ? arena_alloc(a, size, 1) : NULL;
	if (!copy)
		return NULL;
	if (size)
		memcpy(copy, bytes, size);
	*new = (struct arena_interned){.bytes = copy, .size = size};
	if (!full)
		insert_interned(a->intern_table, hash, new);
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
