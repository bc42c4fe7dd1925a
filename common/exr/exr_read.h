/* SPDX-License-Identifier: Apache-2.0 */
/* Reads images from OpenEXR files in memory, whoever wrote them; half, float and unsigned channels become float. The
 * header is checked before anything is decoded. Any thread. */
#ifndef COMMON_EXR_EXR_READ_H
#define COMMON_EXR_EXR_READ_H

#include "common/exr/exr_image.h"

/* Reads an image, which exr_image_fini frees. Returns 0; -ENOTSUP for a file compressed by DWA (exr_dwa.h), -EBADMSG
 * for any other file that cannot be read, -ENOMEM. The image is empty after an error. */
int exr_read(const unsigned char *bytes, size_t size, struct exr_image *img, struct error *e);
/* Like exr_read, but returns -EFBIG, before anything is decoded, if the planes would take more than max_bytes. */
int exr_read_limited(const unsigned char *bytes, size_t size, int64_t max_bytes, struct exr_image *img,
		     struct error *e);

#endif
