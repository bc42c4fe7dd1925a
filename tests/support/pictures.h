/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Pictures in memory, as Radiance HDR files behind an asset source. Pixel values must be exact with 8 bits of mantissa
 * per pixel (small multiples of powers of two). One thread; names are "p0", "p1", ...
 */
#ifndef TESTS_SUPPORT_PICTURES_H
#define TESTS_SUPPORT_PICTURES_H

#include "worker/render/asset/asset.h"

#include <stdint.h>

struct picture_file {
	unsigned char *bytes;
	size_t size;
};

struct pictures {
	struct picture_file file[8];
	int count;
};

void pictures_add(struct pictures *p, uint32_t width, uint32_t height, const double *rgb);
struct asset_source pictures_source(struct pictures *p);
void pictures_fini(struct pictures *p);

#endif
