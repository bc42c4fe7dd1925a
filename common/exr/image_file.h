/* SPDX-License-Identifier: Apache-2.0 */
/* Writes an image as an EXR file, with header and errors beside colours, atomically. Any thread. */
#ifndef COMMON_EXR_IMAGE_FILE_H
#define COMMON_EXR_IMAGE_FILE_H

#include "common/exr/header.h"

/* Channels R G B; with more than one group error.R error.G error.B; with several chains rhat.Y, the potential scale
 * reduction of the pixel's tile, 0 where no chain came. Bytes are mem_alloc'd. */
int image_file_encode(const struct canvas_image *img, const struct plan *p, const struct header_extra *x,
		      unsigned char **bytes, size_t *size, struct error *e);

/* Temporary file, fsync, rename, fsync of the folder; targets that are not regular files are written directly
 * (common/base/target.h). */
int image_file_write(const char *path, const unsigned char *bytes, size_t size, struct error *e);

/* Whether image_file_write could write there: checked before hours are spent. Leaves nothing behind. */
int image_file_probe(const char *path, struct error *e);

/* Reads the whole file, or a pipe to its end, at most 2^32 bytes; bytes are mem_alloc'd. */
int image_file_read(const char *path, unsigned char **bytes, size_t *size, struct error *e);

#endif
