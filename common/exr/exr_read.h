/* SPDX-License-Identifier: Apache-2.0 */
/* Images from OpenEXR files in memory, our own and others: half, float and unsigned channels become float. Any thread;
 * foreign bytes are checked before decoding. */
#ifndef COMMON_EXR_EXR_READ_H
#define COMMON_EXR_EXR_READ_H

#include "common/exr/exr_image.h"

/* -ENOTSUP: compressed by DWA (exr_dwa.h). */
int exr_read(const unsigned char *bytes, size_t size, struct exr_image *img, struct error *e);
/* The same; -EFBIG, before anything is decoded, if its planes would take more bytes than this. */
int exr_read_within(const unsigned char *bytes, size_t size, int64_t bytes_most, struct exr_image *img,
		    struct error *e);

#endif
