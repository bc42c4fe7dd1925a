/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images as OpenEXR files in memory: R G B float (and error.R,G,B), ZIP, scan lines. Any thread.
 */
#ifndef COMMON_EXR_EXR_IMAGE_H
#define COMMON_EXR_EXR_IMAGE_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { EXR_CHANNELS_MOST = 16 };
#define EXR_PIXELS_MOST (INT64_C(1) << 28)

struct exr_attribute { /* header attributes "hslt:..."; see header.h for the table of names and types */
	const char *name;
	enum { EXR_ATTRIBUTE_STRING, EXR_ATTRIBUTE_DOUBLE, EXR_ATTRIBUTE_INT } type;
	const char *string;
	double number;
	int integer;
};

struct exr_image {
	uint32_t width, height, channel_count;
	uint32_t full_width, full_height, x, y; /* the display window, and the data window's corner */
	char names[EXR_CHANNELS_MOST][32];	/* "R", "error.G", sorted by the library */
	float *planes[EXR_CHANNELS_MOST];	/* [height][width] each */
	bool has_primaries;			/* when read: the header says what R, G and B are */
	float primaries[8];			/* CIE 1931 x, y of red, green, blue and white, as stored */
	size_t attribute_count;
	struct exr_attribute *attributes; /* when read: all hslt:* attributes of these types; owned */
};

/* The index of the channel with this name; EXR_CHANNELS_MOST: no such channel. */
uint32_t exr_channel(const struct exr_image *img, const char *name);
const float *exr_plane(const struct exr_image *img, const char *name); /* NULL: no such channel */
/* NULL: no such attribute */
const struct exr_attribute *exr_attribute_find(const struct exr_image *img, const char *name);

/* bytes are mem_alloc'd; free them with mem_free. */
int exr_write(const struct exr_image *img, unsigned char **bytes, size_t *size, struct error *e);
void exr_image_fini(struct exr_image *img);

#endif
