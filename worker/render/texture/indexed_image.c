/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/indexed_image.h"

#include "common/base/mem.h"

#include <stdbool.h>
#include <string.h>

enum {
	PALETTE_MAX = 1 << 16, /* the most numbers that an index of two bytes can distinguish */
	/* The most failed probes per value, on average. A file whose numbers collide more often is stored without
	 * indices, since indexing it could take hours. */
	FAILED_PROBES_MAX = 8,
};

/* The distinct numbers of an image, in a hash table with open addressing. Numbers are compared by their bits, so that
 * -0 differs from 0. */
struct number_table {
	struct {
		uint32_t bits, index_plus_1; /* index_plus_1: 1 + the index of the number; 0: the slot is free */
	} * slot;
	uint32_t slot_count; /* a power of two, at least twice the most numbers */
	uint32_t count;
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
	uint32_t slot = first_slot(bits) & (t->slot_count - 1);
	while (t->slot[slot].index_plus_1 && t->slot[slot].bits != bits)
		slot = (slot + 1) & (t->slot_count - 1);
	return slot;
}

/* Enters all numbers into the table. Returns false if there are more than an index can distinguish, or if there are too
 * many collisions. */
static bool collect_numbers(struct number_table *t, const float *x, size_t count)
{
	size_t failed_probes = 0;
	for (size_t i = 0; i < count; i++) {
		uint32_t bits = bits_of(x[i]), slot = slot_of(t, bits);
		failed_probes += (slot - first_slot(bits)) & (t->slot_count - 1);
		if (failed_probes > FAILED_PROBES_MAX * count)
			return false;
		if (t->slot[slot].index_plus_1)
			continue;
		if (t->count == PALETTE_MAX)
			return false;
		t->slot[slot].bits = bits;
		t->slot[slot].index_plus_1 = ++t->count;
	}
	return true;
}

static size_t value_count(const struct image *i)
{
	return (size_t)i->width * i->height * i->channels;
}

/* Allocates memory for the numbers and, if bytes > 0, for `count` indices of that size. -EFBIG or -ENOMEM. */
static int allocate_image(struct indexed_image *out, size_t palette_count, size_t count, size_t index_bytes,
			  void **index, struct arena *arena, struct error *e)
{
	size_t bytes_needed = palette_count * sizeof *out->palette + count * index_bytes;
	if (bytes_needed + arena->used > IMAGE_SCENE_BYTES_MAX)
		return error_set(
			e, EFBIG, "%u x %u pixels take %zu MB, the scene before it %zu MB; at most %zu MB together",
			out->width, out->height, bytes_needed >> 20, arena->used >> 20, IMAGE_SCENE_BYTES_MAX >> 20);
	out->palette = arena_alloc(arena, palette_count, sizeof *out->palette);
	*index = index_bytes ? arena_alloc(arena, count, index_bytes) : NULL;
	return !out->palette || (index_bytes && !*index) ? error_set(e, ENOMEM, "out of memory") : 0;
}

static int make_indices(const struct number_table *t, const float *x, size_t count, struct arena *arena,
			struct indexed_image *out, struct error *e)
{
	void *index = NULL;
	bool is_8_bit = t->count <= UINT8_MAX + 1;
	int r = allocate_image(out, t->count, count, is_8_bit ? 1 : 2, &index, arena, e);
	if (r)
		return r;
	uint8_t *index8 = is_8_bit ? index : NULL;
	uint16_t *index16 = is_8_bit ? NULL : index;
	for (size_t i = 0; i < count; i++) {
		uint32_t k = t->slot[slot_of(t, bits_of(x[i]))].index_plus_1 - 1;
		out->palette[k] = x[i];
		if (is_8_bit)
			index8[i] = (uint8_t)k;
		else
			index16[i] = (uint16_t)k;
	}
	out->palette_count = t->count;
	out->index8 = index8;
	out->index16 = index16;
	return 0;
}

int indexed_image_make(const struct image *source, struct arena *arena, struct indexed_image *out, struct error *e)
{
	size_t count = value_count(source);
	struct number_table t = {.slot_count = 4};
	*out = (struct indexed_image){.width = source->width, .height = source->height, .channels = source->channels};
	while (t.slot_count < 2 * PALETTE_MAX && t.slot_count < 2 * count)
		t.slot_count *= 2;
	t.slot = mem_alloc(t.slot_count, sizeof *t.slot);
	if (!t.slot)
		return error_set(e, ENOMEM, "out of memory");
	int r;
	if (collect_numbers(&t, source->pixels, count)) {
		r = make_indices(&t, source->pixels, count, arena, out, e);
	} else {
		void *none = NULL;
		r = allocate_image(out, count, count, 0, &none, arena, e);
		if (!r)
			memcpy(out->palette, source->pixels, count * sizeof *out->palette);
	}
	mem_free(t.slot);
	return r;
}

struct indexed_image indexed_image_wrap(const struct image *source)
{
	return (struct indexed_image){source->width, source->height, source->channels, .palette = source->pixels};
}

size_t indexed_image_palette_count(const struct indexed_image *i)
{
	return i->index8 || i->index16 ? i->palette_count : (size_t)i->width * i->height * i->channels;
}
