/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An image that keeps each of its numbers once, and for each place where one stands an index of one or two bytes: a
 * quarter of the memory where a file has 8 bits, half where it has 16 or half floats. Without loss, whatever the file
 * was. An image with more numbers keeps them as they are. Immutable but for indexed_image_numbers; any thread.
 */
#ifndef WORKER_RENDER_TEXTURE_INDEXED_IMAGE_H
#define WORKER_RENDER_TEXTURE_INDEXED_IMAGE_H

#include "common/base/arena.h"
#include "common/base/error.h"
#include "worker/render/image/image_pixels.h"

#include <stddef.h>

#define IMAGE_SCENE_BYTES_MAX ((size_t)4 << 30) /* of everything in an arena that holds images */

struct indexed_image {
	uint32_t width, height, channels; /* channels: 1 or 3 */
	float *number;			  /* the different ones; without indices all: [height][width][channels] */
	const uint8_t *index8;		  /* [height][width][channels]; at most one of these, else NULL */
	const uint16_t *index16;
	uint32_t numbers; /* with indices: how many */
};

/* A copy, in the arena. -ENOMEM, or -EFBIG if that would hold more than IMAGE_SCENE_BYTES_MAX, with a sentence. */
int indexed_image_make(const struct image *from, struct arena *arena, struct indexed_image *out, struct error *e);
/* The pixels of `from`, not copied. */
struct indexed_image indexed_image_of(const struct image *from);
/* How many numbers there are to look at or to change, by a rule for each: those at out->number. */
size_t indexed_image_numbers(const struct indexed_image *i);

/* The number at a place, counted through rows, columns and channels. */
static inline float indexed_image_at(const struct indexed_image *i, size_t place)
{
	return i->number[i->index8 ? i->index8[place] : i->index16 ? i->index16[place] : place];
}

#endif
