/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/picture_cache.h"

#include <string.h>

struct picture_entry {
	struct picture_key key;
	struct picture picture;
	double min, max;  /* the range to which the pixels were clamped; if that changed none, their own range */
	bool was_clamped; /* clamping changed some pixel */
	struct picture_entry *next;
};

static bool keys_are_equal(const struct picture_key *a, const struct picture_key *b)
{
	return a->first_byte == b->first_byte && a->byte_count == b->byte_count && a->skip_bytes == b->skip_bytes &&
	       a->is_base64 == b->is_base64 && a->is_linear == b->is_linear && a->channel == b->channel &&
	       a->threshold == b->threshold && a->power == b->power && strcmp(a->name, b->name) == 0;
}

static uint64_t hash_mix(uint64_t h, uint64_t word)
{
	return (h ^ word) * 0x100000001b3 ^ h >> 29;
}

/* Returns the list of a key. Only some members are hashed; equal keys have equal hashes. */
static size_t bucket_of(const struct picture_key *k)
{
	const double number[2] = {k->threshold, k->power};
	uint64_t words[2], h = 0xcbf29ce484222325;
	memcpy(words, number, sizeof words);
	for (const char *p = k->name; *p; p++)
		h = hash_mix(h, (unsigned char)*p);
	h = hash_mix(hash_mix(hash_mix(h, (uint64_t)k->first_byte), words[0]), words[1]);
	return (h ^ h >> 32) % PICTURE_BUCKETS;
}

struct picture *picture_find(const struct picture_cache *c, const struct picture_key *k, double min, double max)
{
	for (struct picture_entry *p = c->bucket[bucket_of(k)]; p; p = p->next) {
		bool fits = p->was_clamped ? p->min == min && p->max == max : p->min >= min && p->max <= max;
		if (fits && keys_are_equal(&p->key, k))
			return &p->picture;
	}
	return NULL;
}

/* Computes the smallest and the largest value of an image. */
static void compute_range(const struct indexed_image *i, double *min, double *max)
{
	size_t count = indexed_image_palette_count(i);
	float low = i->palette[0], high = low;
	for (size_t k = 1; k < count; k++) {
		low = i->palette[k] < low ? i->palette[k] : low;
		high = i->palette[k] > high ? i->palette[k] : high;
	}
	*min = (double)low;
	*max = (double)high;
}

struct picture *picture_add(struct picture_cache *c, const struct picture_key *k, const struct indexed_image *image,
			    double min, double max, bool was_clamped, struct arena *arena)
{
	struct picture_entry *p = arena_alloc(arena, 1, sizeof *p), **bucket = &c->bucket[bucket_of(k)];
	char *name = arena_strdup(arena, k->name);
	if (!p || !name)
		return NULL;
	*p = (struct picture_entry){*k,	    {*image, .max_value = -1, .spectrum_bound = -1}, min, max, was_clamped,
				    *bucket};
	p->key.name = name;
	if (!was_clamped)
		compute_range(image, &p->min, &p->max);
	*bucket = p;
	return &p->picture;
}
