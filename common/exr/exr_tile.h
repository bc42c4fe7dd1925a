/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tiles as OpenEXR files in memory: one tiled part, channels X, Y and Z of floats, uncompressed, with the data window
 * at the tile's place in the film. Any thread; foreign bytes are checked before decoding.
 */
#ifndef COMMON_EXR_EXR_TILE_H
#define COMMON_EXR_EXR_TILE_H

#include "common/base/error.h"
#include "common/film/batch.h"

#include <stddef.h>

/* Returns at least the size of the file of a tile, in bytes. */
size_t exr_tile_size_max(uint32_t width, uint32_t height);
/* Encodes a tile; *bytes is freed with mem_free. Returns 0, -EINVAL for a wrong size, or -ENOMEM. */
int exr_tile_write(const struct tile *t, uint32_t full_width, uint32_t full_height, unsigned char **bytes, size_t *size,
		   struct error *e);
/* Decodes a tile of a film of that full size; t->xyz is freed with mem_free. Returns 0; -EBADMSG for anything that
 * exr_tile_write does not produce; or -ENOMEM. */
int exr_tile_read(const unsigned char *bytes, size_t size, uint32_t full_width, uint32_t full_height, struct tile *t,
		  struct error *e);

#endif
