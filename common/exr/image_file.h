/* SPDX-License-Identifier: Apache-2.0 */
/* Image files: encodes an image with its errors and header as EXR, writes files atomically, reads them. Any thread. */
#ifndef COMMON_EXR_IMAGE_FILE_H
#define COMMON_EXR_IMAGE_FILE_H

#include "common/exr/header.h"

/* Encodes an image as EXR. Channels: R, G, B; if there are several groups, error.R, error.G, error.B; if there are
 * several chains, rhat.Y, the potential scale reduction of the pixel's tile, 0 where no chain came. *bytes is freed
 * with mem_free. Returns 0, -EINVAL or -ENOMEM. */
int image_file_encode(const struct canvas_image *img, const struct plan *p, const struct header_extra *x,
		      unsigned char **bytes, size_t *size, struct error *e);

/* Writes a file atomically and durably: temporary file, fsync, rename, fsync of the folder. Targets that are not
 * regular files are written directly (common/base/output_target.h). Returns 0 or -errno. */
int image_file_write(const char *path, const unsigned char *bytes, size_t size, struct error *e);

/* Returns 0 if image_file_write can write there, otherwise -errno: to be called before hours of work are spent. Leaves
 * nothing behind. */
int image_file_probe(const char *path, struct error *e);

/* Reads a regular file, or a pipe to its end, of at most 2^32 bytes; *bytes is freed with mem_free. Returns 0 or
 * -errno. */
int image_file_read(const char *path, unsigned char **bytes, size_t *size, struct error *e);

#endif
