/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images as OpenEXR files in memory: named channels of floats, written as scan lines with ZIP compression. Any thread.
 */
#ifndef COMMON_EXR_EXR_IMAGE_H
#define COMMON_EXR_EXR_IMAGE_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { EXR_CHANNELS_MAX = 16 };
#define EXR_PIXELS_MAX (INT64_C(1) << 28)

/* A header attribute "hslt:..."; header_list.h has the table of names and types. */
struct exr_attribute {
	const char *name;
	enum { EXR_ATTRIBUTE_STRING, EXR_ATTRIBUTE_DOUBLE, EXR_ATTRIBUTE_INT } type;
	const char *string;
	double number;
	int integer;
};

struct exr_image {
	uint32_t width, height, channel_count;
	uint32_t full_width, full_height, x, y;	  /* the display window, and the data window's corner in it */
	char channel_names[EXR_CHANNELS_MAX][32]; /* "R", "error.G"; the library sorts the channels of a file by name */
	float *planes[EXR_CHANNELS_MAX];	  /* [height][width] each */
	bool has_primaries;			  /* after reading: the header defines the primaries */
	float primaries[8];			  /* CIE 1931 x, y of red, green, blue and white, as stored */
	size_t attribute_count;
	struct exr_attribute *attributes; /* after reading: all hslt:* attributes of a known type; owned */
};

/* Returns the index of a channel; EXR_CHANNELS_MAX if there is none of this name. */
uint32_t exr_channel_index(const struct exr_image *img, const char *name);
/* Returns the plane of a channel; NULL if there is none of this name. */
const float *exr_find_plane(const struct exr_image *img, const char *name);
/* Returns an attribute; NULL if there is none of this name. */
const struct exr_attribute *exr_find_attribute(const struct exr_image *img, const char *name);

/* Encodes the image; *bytes is freed with mem_free. Returns 0, -EINVAL for a size or number of channels that cannot be
 * written, or -ENOMEM. */
int exr_write(const struct exr_image *img, unsigned char **bytes, size_t *size, struct error *e);
/* Frees planes and attributes. */
void exr_image_fini(struct exr_image *img);

#endif
