/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The images that a scene has decoded: materials that use the same image share its pixels. One arena holds pixels and
 * list; one thread; freed with the arena.
 */
#ifndef WORKER_RENDER_TEXTURE_PICTURE_CACHE_H
#define WORKER_RENDER_TEXTURE_PICTURE_CACHE_H

#include "worker/render/image/image.h"
#include "worker/render/texture/indexed_image.h"

struct picture_entry;

/* By hashes of their keys: a scene may read one image in 10^5 ways. */
enum { PICTURE_LISTS = 1 << 10 };
struct picture_cache {
	const struct arena *arena; /* further images are not shared */
	struct picture_entry *first[PICTURE_LISTS];
};

/* Everything that determines the pixels, except for the range that they are clamped to. */
struct picture_key {
	const char *name;
	int64_t first_byte, byte_count, skip_bytes;
	bool base64, linear;
	enum image_channel channel;
	double threshold, power; /* power: what the stored numbers are raised to; 1 unless linear */
};

struct picture {
	struct indexed_image image;
	/* Space for users; negative: not known yet. */
	double largest; /* of all numbers, at least 0 */
	double bound;	/* of the spectra of all pixels */
};

/* The pixels with that key whose values equal those clamped to [least, largest]. NULL: there are none. */
struct picture *picture_find(const struct picture_cache *c, const struct picture_key *k, double least, double largest);
/* image: was clamped to [least, largest], and `cut` says whether that changed anything. If memory is out, it is not
 * shared. */
struct picture *picture_add(struct picture_cache *c, const struct picture_key *k, const struct indexed_image *image,
			    double least, double largest, bool cut, struct arena *arena);

#endif
