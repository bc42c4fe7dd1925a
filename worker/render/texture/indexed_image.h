/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An image that stores each distinct number once, and for each value an index of one or two bytes: a quarter of the
 * memory of floats if the file has 8 bits per value, half if it has 16 bits or half floats. This is lossless. An image
 * with too many distinct numbers is stored as floats. Immutable, except for the changes that
 * indexed_image_palette_count describes; any thread.
 */
#ifndef WORKER_RENDER_TEXTURE_INDEXED_IMAGE_H
#define WORKER_RENDER_TEXTURE_INDEXED_IMAGE_H

#include "common/base/arena.h"
#include "common/base/error.h"
#include "worker/render/image/image_pixels.h"

#include <stddef.h>

#define IMAGE_SCENE_BYTES_MAX ((size_t)4 << 30) /* limit of everything in an arena that holds images */

struct indexed_image {
	uint32_t width, height, channels; /* channels: 1 or 3 */
	float *palette;			  /* the distinct numbers; without indices all: [height][width][channels] */
	const uint8_t *index8;		  /* [height][width][channels]; at least one of index8 and index16 is NULL */
	const uint16_t *index16;
	uint32_t palette_count; /* with indices */
};

/* Copies an image into the arena. Returns 0, -ENOMEM, or -EFBIG with a sentence if the arena would hold more than
 * IMAGE_SCENE_BYTES_MAX. */
int indexed_image_make(const struct image *source, struct arena *arena, struct indexed_image *out, struct error *e);
/* Returns an image that refers to the pixels of `source` without copying them. */
struct indexed_image indexed_image_wrap(const struct image *source);
/* Returns the count of numbers at i->palette. To inspect or map all values of the image, it suffices to do so with
 * these numbers. */
size_t indexed_image_palette_count(const struct indexed_image *i);

/* Returns the value at a place, counted in the order [height][width][channels]. */
static inline float indexed_image_value(const struct indexed_image *i, size_t index)
{
	return i->palette[i->index8 ? i->index8[index] : i->index16 ? i->index16[index] : index];
}

#endif
