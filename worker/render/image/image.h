/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Decoded images: linear Rec. 709 floats, rows from top to bottom. PNG, JPEG, WebP, EXR, Radiance HDR, BMP,
 * PGM, PPM and PFM are recognised by content, TGA by its name or by its signature. Integers of any format are sRGB,
 * whatever gamma it claims. Damaged files are an error, never half an image. Any thread, each with its own arena.
 */
#ifndef WORKER_RENDER_IMAGE_IMAGE_H
#define WORKER_RENDER_IMAGE_IMAGE_H

#include "common/base/arena.h"
#include "common/base/error.h"
#include "worker/render/image/image_pixels.h"

#include <stdbool.h>

/* A part of each pixel. */
enum image_channel {
	IMAGE_ALL,
	IMAGE_RED,
	IMAGE_GREEN,
	IMAGE_BLUE,
	IMAGE_ALPHA, /* of PNG, WebP and TGA; 1 if an image has none, -ENOTSUP for formats whose alpha is not read */
	IMAGE_LUMINANCE, /* these two: image_grey */
	IMAGE_MEAN,
};

/* "r", "g", "b" or "a"; all of each pixel for any other name. */
enum image_channel image_channel_named(const char *name);
/* raw: integers are not decoded from sRGB. At most 2^27 pixels and 1 GiB of floats: -EFBIG, with the file and its size,
 * before it is decoded. name: for messages, and for TGA. */
int image_decode(const unsigned char *bytes, size_t size, const char *name, bool raw, enum image_channel channel,
		 struct arena *arena, struct image *out, struct error *e);
/* One number of each pixel, its luminance or the mean of red, green and blue. */
void image_grey(struct image *i, enum image_channel as);

/* Raises each number to a positive power (1: nothing changes), negative ones by their size. -ERANGE: one gets too large
 * for a float. */
int image_power(struct image *i, double power, struct error *e);

#endif
