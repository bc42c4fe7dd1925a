/* SPDX-License-Identifier: Apache-2.0 */
/* The image as a file: EXR with header, errors beside colours, and put in place as a whole or not at all. Any thread.
 */
#ifndef COMMON_EXR_IMAGE_FILE_H
#define COMMON_EXR_IMAGE_FILE_H

#include "common/exr/header.h"

/* R G B; with more than one group error.R error.G error.B; with several chains rhat.Y, the potential scale reduction of
 * the tile that the pixel lies in, 0 where no chain came. Bytes are mem_alloc'd. */
int image_file_encode(const struct canvas_image *img, const struct plan *p, const struct header_extra *x,
		      unsigned char **bytes, size_t *size, struct error *e);

/* Temporary file beside it, fsync, rename, fsync of the folder; what is no regular file is written to
 * (common/base/target.h). */
int image_file_write(const char *path, const unsigned char *bytes, size_t size, struct error *e);

/* Whether image_file_write could put a file there: asked before hours are spent. Leaves nothing behind. */
int image_file_probe(const char *path, struct error *e);

/* The whole file, at most 2^32 bytes; bytes are mem_alloc'd. */
int image_file_read(const char *path, unsigned char **bytes, size_t *size, struct error *e);

#endif
