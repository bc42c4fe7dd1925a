/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images as OpenEXR files in memory: R G B float (and error.R,G,B), ZIP, scan lines. Any thread; foreign bytes are
 * checked before decoding.
 */
#ifndef COMMON_EXR_EXR_IMAGE_H
#define COMMON_EXR_EXR_IMAGE_H

#include "common/base/error.h"

#include <stddef.h>
#include <stdint.h>

struct exr_attribute { /* header attributes "hslt:..."; see header.h for the table of names and types */
	const char *name;
	enum { EXR_ATTRIBUTE_STRING, EXR_ATTRIBUTE_DOUBLE, EXR_ATTRIBUTE_INT } type;
	const char *string;
	double number;
	int integer;
};

struct exr_image {
	uint32_t width, height, channel_count;	/* at most 16 channels */
	uint32_t full_width, full_height, x, y; /* the display window, and the data window's corner */
	char names[16][32];			/* "R", "error.G", sorted by the library */
	float *planes[16];			/* [height][width] each */
	size_t attribute_count;
	struct exr_attribute *attributes; /* when read: all hslt:* attributes of these types; owned */
};

/* bytes are mem_alloc'd; free them with mem_free. */
int exr_write(const struct exr_image *img, unsigned char **bytes, size_t *size, struct error *e);
int exr_read(const unsigned char *bytes, size_t size, struct exr_image *img,
	     struct error *e); /* half, float, uint channels */
/* The same; -EFBIG, before anything is decoded, if its planes would take more bytes than this. */
int exr_read_within(const unsigned char *bytes, size_t size, int64_t bytes_most, struct exr_image *img,
		    struct error *e);
void exr_image_fini(struct exr_image *img);

#endif
