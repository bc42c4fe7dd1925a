/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/picture_cache.h"

#include <string.h>

struct picture_entry {
	struct picture_key key;
	struct picture picture;
	double least, largest; /* the range to which the pixels were clamped; if that changed none, their own range */
	bool cut;	       /* clamping changed some pixel */
	struct picture_entry *next;
};

static bool same_key(const struct picture_key *a, const struct picture_key *b)
{
	return a->first_byte == b->first_byte && a->byte_count == b->byte_count && a->skip_bytes == b->skip_bytes &&
	       a->base64 == b->base64 && a->linear == b->linear && a->channel == b->channel &&
	       a->threshold == b->threshold && a->power == b->power && strcmp(a->name, b->name) == 0;
}

static uint64_t mix(uint64_t h, uint64_t word)
{
	return (h ^ word) * 0x100000001b3 ^ h >> 29;
}

/* Returns the list of a key. Only some members are hashed; equal keys have equal hashes. */
static size_t list_of(const struct picture_key *k)
{
	const double number[2] = {k->threshold, k->power};
	uint64_t words[2], h = 0xcbf29ce484222325;
	memcpy(words, number, sizeof words);
	for (const char *p = k->name; *p; p++)
		h = mix(h, (unsigned char)*p);
	h = mix(mix(mix(h, (uint64_t)k->first_byte), words[0]), words[1]);
	return (h ^ h >> 32) % PICTURE_LISTS;
}

struct picture *picture_find(const struct picture_cache *c, const struct picture_key *k, double least, double largest)
{
	for (struct picture_entry *p = c->first[list_of(k)]; p; p = p->next) {
		bool fits = p->cut ? p->least == least && p->largest == largest
				   : p->least >= least && p->largest <= largest;
		if (fits && same_key(&p->key, k))
			return &p->picture;
	}
	return NULL;
}

/* Computes the smallest and the largest value of an image. */
static void own_range(const struct indexed_image *i, double *least, double *largest)
{
	size_t count = indexed_image_numbers(i);
	float low = i->number[0], high = low;
	for (size_t k = 1; k < count; k++) {
		low = i->number[k] < low ? i->number[k] : low;
		high = i->number[k] > high ? i->number[k] : high;
	}
	*least = (double)low;
	*largest = (double)high;
}

struct picture *picture_add(struct picture_cache *c, const struct picture_key *k, const struct indexed_image *image,
			    double least, double largest, bool cut, struct arena *arena)
{
	struct picture_entry *p = arena_alloc(arena, 1, sizeof *p), **first = &c->first[list_of(k)];
	char *name = arena_strdup(arena, k->name);
	if (!p || !name)
		return NULL;
	*p = (struct picture_entry){*k, {*image, .largest = -1, .bound = -1}, least, largest, cut, *first};
	p->key.name = name;
	if (!cut)
		own_range(image, &p->least, &p->largest);
	*first = p;
	return &p->picture;
}
