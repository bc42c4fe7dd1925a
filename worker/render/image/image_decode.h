/* SPDX-License-Identifier: Apache-2.0 */
/* What the formats behind image_decode() have in common. Each format decodes bytes in memory, whatever they contain,
 * and yields an image or an error; image_decode() puts the file's name in front of the error. */
#ifndef WORKER_RENDER_IMAGE_IMAGE_DECODE_H
#define WORKER_RENDER_IMAGE_IMAGE_DECODE_H

#include "common/base/arena.h"
#include "common/base/error.h"
#include "worker/render/image/image_pixels.h"

#include <stdbool.h>
#include <stddef.h>

/* Limits checked before decoding, because a small file may declare a large image: 16,384 x 8,192 pixels, the size of
 * the largest panoramas, with three float channels. */
enum { IMAGE_PIXELS_MAX = 1 << 27, IMAGE_BYTES_MAX = 3 << 29 };

struct image_input {
	const char *name;
	const unsigned char *bytes;
	size_t size;
	bool is_raw, needs_only_alpha; /* needs_only_alpha: with the stored values */
	struct arena *arena;
	struct error *error;
};

/* A file format; image_formats.h lists all formats. */
struct image_format {
	const char *signatures[5];		       /* possible first bytes of such a file; ends with NULL */
	bool (*matches)(const struct image_input *in); /* another way to recognise such a file, or NULL */
	int (*decode)(const struct image_input *in, struct image *out);
	enum {
		IMAGE_ALPHA_NOT_READ,
		IMAGE_ALPHA_READ,
		IMAGE_ALPHA_NONE
	} alpha_support; /* _NONE: the format has no alpha */
};

/* Checks the size of the image and then allocates its pixels. min_file_bytes is the smallest file that can hold such an
 * image with the format's best compression: a shorter file is refused before anything is allocated. */
int image_allocate(const struct image_input *in, struct image *out, uint64_t width, uint64_t height, uint32_t channels,
		   uint64_t min_file_bytes);

/* Tabulates the values of integer samples: table[i] for i in 0..max. */
void image_fill_sample_table(float *table, uint32_t max, bool raw);

#endif
