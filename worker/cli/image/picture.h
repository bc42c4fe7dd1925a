/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images for the programs that process them: reading R, G, B of an EXR file, optionally averaged down, and writing PNG
 * files. Planes of floats, linear. One thread.
 */
#ifndef WORKER_CLI_IMAGE_PICTURE_H
#define WORKER_CLI_IMAGE_PICTURE_H

#include "common/base/error.h"
#include "common/exr/exr_image.h"

struct picture {
	struct exr_image image; /* all channels, as read */
	const float *rgb[3];	/* the planes of R, G and B in `image` */
};

/* Reads an EXR file. Errors name the file; -EINVAL if it lacks R, G or B. */
int picture_read(struct picture *p, const char *path, struct error *e);
void picture_fini(struct picture *p);

/* Reduces the image to this size by averaging equal boxes; keeps R, G and B only. -EINVAL if width and height do not
 * divide the image's. */
int picture_shrink(struct picture *p, uint32_t width, uint32_t height, struct error *e);

/* Encodes an sRGB image, 3 bytes per pixel, as PNG; *bytes is freed with mem_free. */
int picture_encode_png(const unsigned char *rgb, uint32_t width, uint32_t height, unsigned char **bytes, size_t *size,
		       struct error *e);
/* Writes a PNG file atomically (image_file_write). */
int picture_write_png(const char *path, const unsigned char *rgb, uint32_t width, uint32_t height, struct error *e);

#endif
