/* SPDX-License-Identifier: Apache-2.0 */
/* Checks the header of a foreign EXR file before anything is allocated or decoded. Private to this folder. */
#ifndef COMMON_EXR_EXR_CHECK_H
#define COMMON_EXR_EXR_CHECK_H

#include "common/exr/exr_image.h"
#include "common/exr/exr_stream.h"

#include <stdbool.h>

struct exr_limits {
	int64_t max_bytes;     /* of all planes, as floats */
	int64_t max_inflation; /* most bytes of pixels that one byte of the file can represent */
};

bool exr_is_dwa(exr_compression_t c);

/* Accepts a file of one flat part within the limits, and long enough for its number of pixels. Stores sizes, channels
 * and primaries in img, whose planes stay NULL, and whether the part is tiled. Returns 0, -EFBIG if the planes would
 * exceed limits->max_bytes, or -EBADMSG. */
int exr_check_header(exr_context_t x, const struct exr_stream *s, const struct exr_limits *limits,
		     struct exr_image *img, bool *tiled, struct error *e);

#endif
