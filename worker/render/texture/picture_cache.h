/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The images that a scene has decoded, so that materials that use the same image share its pixels. One arena holds the
 * pixels and the cache, which is freed with it. One thread.
 */
#ifndef WORKER_RENDER_TEXTURE_PICTURE_CACHE_H
#define WORKER_RENDER_TEXTURE_PICTURE_CACHE_H

#include "worker/render/image/image.h"
#include "worker/render/texture/indexed_image.h"

struct picture_entry;
struct scene_node;

/* The images with a pixel below the range to which they were clamped. */
struct raised_pictures {
	const struct scene_node *first; /* the object that read the first of them; NULL: there is none */
	uint64_t pixel_count;		/* such pixels of the first image */
	bool has_others;		/* there are more images */
};

/* A hash table by key: a scene may read one image in 10^5 different ways. */
enum { PICTURE_BUCKETS = 1 << 10 };
struct picture_cache {
	const struct arena *arena; /* images in other arenas are not shared */
	struct raised_pictures raised;
	struct picture_entry *bucket[PICTURE_BUCKETS];
};

/* Everything that determines the pixels, except the range to which they are clamped. */
struct picture_key {
	const char *name;
	int64_t first_byte, byte_count, skip_bytes;
	bool is_base64, is_linear;
	enum image_channel channel;
	double threshold, power; /* power: exponent applied to the stored numbers; 1 unless linear */
};

struct picture {
	struct indexed_image image;
	/* Computed by users of the picture; negative: not known yet. */
	double max_value;      /* at least 0 */
	double spectrum_bound; /* upper bound of the spectra of all pixels */
};

/* Returns a picture with this key whose pixels are the same as if clamped to [min, max], or NULL if there is
 * none. */
struct picture *picture_find(const struct picture_cache *c, const struct picture_key *k, double min, double max);
/* Adds an image that was clamped to [min, max]; was_clamped: whether that changed any pixel. Returns NULL if out of
 * memory; the image is then not shared. */
struct picture *picture_add(struct picture_cache *c, const struct picture_key *k, const struct indexed_image *image,
			    double min, double max, bool was_clamped, struct arena *arena);

#endif
