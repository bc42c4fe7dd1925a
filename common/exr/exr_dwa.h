/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images compressed by DWA, which OpenEXRCore 3.1 does not decode: by way of OpenEXR's RGBA interface, in half
 * precision, of which DWA loses some anyway. Only for assets of scenes; tiles and our own images are never compressed
 * by it. The last bits depend on whether the processor has AVX, as Embree's do, so workers with one fingerprint agree.
 * Any thread; one decodes at a time.
 */
#ifndef COMMON_EXR_EXR_DWA_H
#define COMMON_EXR_EXR_DWA_H

#include "common/exr/exr_image.h"

/* Like exr_read_within, for a file that it refused with -ENOTSUP. The planes are R, G and B, or Y; there are no
 * attributes. */
int exr_read_dwa(const unsigned char *bytes, size_t size, int64_t bytes_most, struct exr_image *img, struct error *e);

#endif
