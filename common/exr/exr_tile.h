/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tiles as OpenEXR files in memory: one-part, tiled, X Y Z float, uncompressed, data window at their place. Any thread;
 * foreign bytes are checked before decoding.
 */
#ifndef COMMON_EXR_EXR_TILE_H
#define COMMON_EXR_EXR_TILE_H

#include "common/base/error.h"
#include "common/film/batch.h"

#include <stddef.h>

/* exr_tile_read: the display window must be the full film; refuses anything but what exr_tile_write produces. */
size_t exr_tile_size_max(uint32_t width, uint32_t height);
int exr_tile_write(const struct tile *t, uint32_t full_width, uint32_t full_height, unsigned char **bytes, size_t *size,
		   struct error *e);
int exr_tile_read(const unsigned char *bytes, size_t size, uint32_t full_width, uint32_t full_height, struct tile *t,
		  struct error *e);

#endif
