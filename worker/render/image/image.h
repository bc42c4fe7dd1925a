/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Decoded images: linear Rec. 709 floats, rows from top to bottom. PNG, JPEG, WebP, EXR, Radiance HDR, BMP, PGM, PPM
 * and PFM are recognised by their content, TGA by its name or its signature. Integer samples are always taken as sRGB,
 * even if the file states another gamma. A damaged file is an error; its readable part is never returned. Any thread,
 * each with its own arena.
 */
#ifndef WORKER_RENDER_IMAGE_IMAGE_H
#define WORKER_RENDER_IMAGE_IMAGE_H

#include "common/base/arena.h"
#include "common/base/error.h"
#include "worker/render/image/image_pixels.h"

#include <stdbool.h>

/* Which part of each pixel to keep. */
enum image_channel {
	IMAGE_ALL,
	IMAGE_RED,
	IMAGE_GREEN,
	IMAGE_BLUE,
	IMAGE_ALPHA, /* from PNG, WebP and TGA; 1 if the image has none; -ENOTSUP for formats whose alpha is not read */
	IMAGE_LUMINANCE, /* computed by image_convert_to_grey(), as is IMAGE_MEAN */
	IMAGE_MEAN,
};

/* Returns the channel named "r", "g", "b" or "a", and IMAGE_ALL for any other name. */
enum image_channel image_channel_named(const char *name);
/* Decodes a file in memory. raw: integer samples are linear, not sRGB. name: for messages, and to recognise TGA. An
 * image of more than 2^27 pixels or 1.5 GiB of floats is refused with -EFBIG before it is decoded; the error names the
 * file and the size. */
int image_decode(const unsigned char *bytes, size_t size, const char *name, bool raw, enum image_channel channel,
		 struct arena *arena, struct image *out, struct error *e);
/* Replaces each pixel by one number: its luminance or the mean of red, green and blue. */
void image_convert_to_grey(struct image *i, enum image_channel channel);

/* Replaces each number x by sign(x) |x|^power, for power > 0; a power of 1 changes nothing. Returns -ERANGE if a
 * result is too large for a float. */
int image_apply_power(struct image *i, double power, struct error *e);

#endif
