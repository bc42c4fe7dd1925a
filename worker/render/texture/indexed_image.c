/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/indexed_image.h"

#include "common/base/mem.h"

#include <stdbool.h>
#include <string.h>

enum {
	NUMBERS_MAX = 1 << 16, /* the most numbers that an index of two bytes can distinguish */
	/* The most failed probes per value, on average. A file whose numbers collide more often is stored without
	 * indices, since indexing it could take hours. */
	DETOUR_MAX = 8,
};

/* The distinct numbers of an image, in a hash table with open addressing. Numbers are compared by their bits, so that
 * -0 differs from 0. */
struct number_table {
	struct {
		uint32_t bits, known; /* known: 1 + the index of the number; 0: the slot is free */
	} * slot;
	uint32_t slots; /* a power of two, at least twice the most numbers */
	uint32_t numbers;
};

static uint32_t bits_of(float x)
{
	uint32_t bits;
	memcpy(&bits, &x, sizeof bits);
	return bits;
}

static uint32_t first_slot(uint32_t bits)
{
	return bits * 0x9e3779b1u >> 15;
}

/* Returns the slot of the number, or a free one; at least half of the slots are free. */
static uint32_t slot_of(const struct number_table *t, uint32_t bits)
{
	uint32_t at = first_slot(bits) & (t->slots - 1);
	while (t->slot[at].known && t->slot[at].bits != bits)
		at = (at + 1) & (t->slots - 1);
	return at;
}

/* Enters all numbers into the table. Returns false if there are more than an index can distinguish, or if there are too
 * many collisions. */
static bool find_numbers(struct number_table *t, const float *x, size_t count)
{
	size_t detours = 0;
	for (size_t i = 0; i < count; i++) {
		uint32_t bits = bits_of(x[i]), at = slot_of(t, bits);
		detours += (at - first_slot(bits)) & (t->slots - 1);
		if (detours > DETOUR_MAX * count)
			return false;
		if (t->slot[at].known)
			continue;
		if (t->numbers == NUMBERS_MAX)
			return false;
		t->slot[at].bits = bits;
		t->slot[at].known = ++t->numbers;
	}
	return true;
}

static size_t number_count(const struct image *i)
{
	return (size_t)i->width * i->height * i->channels;
}

/* Allocates memory for the numbers and, if bytes > 0, for `count` indices of that size. -EFBIG or -ENOMEM. */
static int allocate(struct indexed_image *out, size_t numbers, size_t count, size_t bytes, void **index,
		    struct arena *arena, struct error *e)
{
	size_t need = numbers * sizeof *out->number + count * bytes;
	if (need + arena->used > IMAGE_SCENE_BYTES_MAX)
		return error_set(e, EFBIG,
				 "%u x %u pixels take %zu MB, the scene before it %zu MB; at most %zu MB together",
				 out->width, out->height, need >> 20, arena->used >> 20, IMAGE_SCENE_BYTES_MAX >> 20);
	out->number = arena_alloc(arena, numbers, sizeof *out->number);
	*index = bytes ? arena_alloc(arena, count, bytes) : NULL;
	return !out->number || (bytes && !*index) ? error_set(e, ENOMEM, "out of memory") : 0;
}

static int make_indices(const struct number_table *t, const float *x, size_t count, struct arena *arena,
			struct indexed_image *out, struct error *e)
{
	void *index = NULL;
	bool bytes = t->numbers <= UINT8_MAX + 1;
	int r = allocate(out, t->numbers, count, bytes ? 1 : 2, &index, arena, e);
	if (r)
		return r;
	uint8_t *index8 = bytes ? index : NULL;
	uint16_t *index16 = bytes ? NULL : index;
	for (size_t i = 0; i < count; i++) {
		uint32_t k = t->slot[slot_of(t, bits_of(x[i]))].known - 1;
		out->number[k] = x[i];
		if (bytes)
			index8[i] = (uint8_t)k;
		else
			index16[i] = (uint16_t)k;
	}
	out->numbers = t->numbers;
	out->index8 = index8;
	out->index16 = index16;
	return 0;
}

int indexed_image_make(const struct image *from, struct arena *arena, struct indexed_image *out, struct error *e)
{
	size_t count = number_count(from);
	struct number_table t = {.slots = 4};
	*out = (struct indexed_image){.width = from->width, .height = from->height, .channels = from->channels};
	while (t.slots < 2 * NUMBERS_MAX && t.slots < 2 * count)
		t.slots *= 2;
	t.slot = mem_alloc(t.slots, sizeof *t.slot);
	if (!t.slot)
		return error_set(e, ENOMEM, "out of memory");
	int r;
	if (find_numbers(&t, from->pixels, count)) {
		r = make_indices(&t, from->pixels, count, arena, out, e);
	} else {
		void *none = NULL;
		r = allocate(out, count, count, 0, &none, arena, e);
		if (!r)
			memcpy(out->number, from->pixels, count * sizeof *out->number);
	}
	mem_free(t.slot);
	return r;
}

struct indexed_image indexed_image_of(const struct image *from)
{
	return (struct indexed_image){from->width, from->height, from->channels, .number = from->pixels};
}

size_t indexed_image_numbers(const struct indexed_image *i)
{
	return i->index8 || i->index16 ? i->numbers : (size_t)i->width * i->height * i->channels;
}
