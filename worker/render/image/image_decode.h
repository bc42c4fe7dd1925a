/* SPDX-License-Identifier: Apache-2.0 */
/* What the formats behind image_decode have in common: each decodes bytes in memory, whatever they contain, into an
 * image or an error, which image_decode prefixes with the file's name. */
#ifndef WORKER_RENDER_IMAGE_IMAGE_DECODE_H
#define WORKER_RENDER_IMAGE_IMAGE_DECODE_H

#include "common/base/arena.h"
#include "common/base/error.h"
#include "worker/render/image/image_pixels.h"

#include <stdbool.h>
#include <stddef.h>

/* Limits checked before decoding, because a small file may promise a large image: 16,384 x 8,192 pixels, as the largest
 * panoramas have, of three channels. */
enum { IMAGE_PIXELS_MAX = 1 << 27, IMAGE_BYTES_MAX = 3 << 29 };

struct image_input {
	const char *name;
	const unsigned char *bytes;
	size_t size;
	bool raw, alpha; /* alpha: only the alpha channel, as stored */
	struct arena *arena;
	struct error *error;
};

/* A file format; image_formats.h lists all. */
struct image_format {
	const char *begins[5];			  /* first bytes of its files, one of these; ends with NULL */
	bool (*is)(const struct image_input *in); /* another way to recognise its files; NULL: none */
	int (*decode)(const struct image_input *in, struct image *out);
	enum { IMAGE_ALPHA_NOT_READ, IMAGE_ALPHA_READ, IMAGE_ALPHA_NONE } alpha; /* NONE: the format has none */
};

/* Checks the size, also against the fewest bytes that such an image can take (bytes_least, for the format's best
 * compression), before anything is allocated; then allocates the pixels. */
int image_allocate(const struct image_input *in, struct image *out, uint64_t width, uint64_t height, uint32_t channels,
		   uint64_t bytes_least);

/* Values of integer samples: value[i] for i in 0..max. */
void image_table(float *value, uint32_t max, bool raw);

#endif
