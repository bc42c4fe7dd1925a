/* SPDX-License-Identifier: Apache-2.0 */
/* What a foreign EXR file's header promises, before anything is allocated or decoded. Private to this folder. */
#ifndef COMMON_EXR_EXR_CHECK_H
#define COMMON_EXR_EXR_CHECK_H

#include "common/exr/exr_image.h"
#include "common/exr/exr_stream.h"

#include <stdbool.h>

struct exr_limits {
	int64_t bytes;	   /* of all planes as floats */
	int64_t inflation; /* bytes of pixels that one byte of the file can represent */
};

bool exr_is_dwa(exr_compression_t c);

/* One flat part of at most these limits, which the file can hold: its sizes and channels into img, whose planes stay
 * NULL. -EBADMSG, -EFBIG. */
int exr_check(exr_context_t x, const struct exr_stream *s, const struct exr_limits *most, struct exr_image *img,
	      bool *tiled, struct error *e);

#endif
