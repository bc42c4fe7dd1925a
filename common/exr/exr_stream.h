/* SPDX-License-Identifier: Apache-2.0 */
/* Files in memory for OpenEXRCore, shared by the sources of this folder. One thread per stream. */
#ifndef COMMON_EXR_EXR_STREAM_H
#define COMMON_EXR_EXR_STREAM_H

#include "common/base/error.h"

#include <OpenEXR/openexr.h>

#include <stddef.h>
#include <stdint.h>

enum { EXR_SIDE_MAX = 1 << 20 };

struct exr_stream {
	const unsigned char *source; /* when reading: the file, not copied */
	unsigned char *bytes;	     /* when writing: the file so far; the caller's after exr_close_write */
	size_t size, capacity;	     /* bytes of the file; bytes allocated for it */
	char message[256];	     /* the library's last error message */
};

/* Open and close return 0, or -EBADMSG or -ENOMEM with a sentence. s must stay in place while x is open. */
int exr_open_read(exr_context_t *x, struct exr_stream *s, const unsigned char *bytes, size_t size, struct error *e);
int exr_open_write(exr_context_t *x, struct exr_stream *s, size_t capacity, struct error *e);
/* Closes x. rc: the library's result so far; unless it is success, the bytes are freed and the error is set. */
int exr_close_write(exr_context_t *x, struct exr_stream *s, exr_result_t rc, unsigned char **bytes, size_t *size,
		    struct error *e);
/* Sets the error to the library's message. Returns -ENOMEM if memory is out, otherwise -EBADMSG. */
int exr_set_error(const struct exr_stream *s, exr_result_t rc, struct error *e);
/* Returns the box of this corner and size. */
exr_attr_box2i_t exr_make_box(uint32_t x, uint32_t y, uint32_t width, uint32_t height);

#endif
