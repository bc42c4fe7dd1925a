/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Pictures that one scene has decoded: materials that use the same picture share its pixels. One arena holds the
 * pixels and the list; one thread; gone with the arena.
 */
#ifndef WORKER_RENDER_TEXTURE_PICTURE_CACHE_H
#define WORKER_RENDER_TEXTURE_PICTURE_CACHE_H

#include "worker/render/scene/image.h"

struct picture_entry;

struct picture_cache {
	const struct arena *arena; /* others' pictures are not shared */
	struct picture_entry *first;
};

/* All that says what the pixels are but for the range that they are cut to. */
struct picture_key {
	const char *name;
	int64_t first_byte, byte_count;
	bool base64, linear;
	enum image_channel channel;
	double threshold;
};

struct picture {
	struct image image;
	double bound; /* room for the user: of the spectra of all pixels; below 0: not known yet */
};

/* The pixels of that key whose values are as they would be cut to [least, largest]. NULL: there are none. */
struct picture *picture_find(const struct picture_cache *c, const struct picture_key *k, double least, double largest);
/* image: was cut to [least, largest], and `cut` says whether anything changed by it. NULL, without memory: it is not
 * shared. */
struct picture *picture_add(struct picture_cache *c, const struct picture_key *k, const struct image *image,
			    double least, double largest, bool cut, struct arena *arena);

#endif
