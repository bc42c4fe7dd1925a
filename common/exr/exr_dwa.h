/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads images compressed by DWA, which OpenEXRCore 3.1 does not decode, through OpenEXR's RGBA interface. Pixels have
 * half precision, which is more than the lossy compression keeps. Only textures and other assets of scenes are read in
 * this way; tiles and images that the programs write are never compressed by DWA. The last bits depend on whether the
 * processor has AVX, as Embree's do, so workers with the same fingerprint agree. Any thread; a lock lets one decode at
 * a time.
 */
#ifndef COMMON_EXR_EXR_DWA_H
#define COMMON_EXR_EXR_DWA_H

#include "common/exr/exr_image.h"

/* Like exr_read_limited, for a file that exr_read_limited refused with -ENOTSUP. The planes are R, G and B, or Y;
 * attributes are not read. */
int exr_read_dwa(const unsigned char *bytes, size_t size, int64_t max_bytes, struct exr_image *img, struct error *e);

#endif
