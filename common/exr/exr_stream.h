/* SPDX-License-Identifier: Apache-2.0 */
/* Files in memory for OpenEXRCore, shared by exr_image.c and exr_tile.c. One thread each. */
#ifndef COMMON_EXR_EXR_STREAM_H
#define COMMON_EXR_EXR_STREAM_H

#include "common/base/error.h"

#include <OpenEXR/openexr.h>

#include <stddef.h>
#include <stdint.h>

enum { EXR_MAX_SIDE = 1 << 20 };

struct exr_stream {
	const unsigned char *source; /* reading */
	unsigned char *bytes;	     /* writing; mem_alloc'd, owned by the caller after exr_close_write */
	size_t size, room;
	char message[256]; /* the library's last error message */
};

int exr_open_read(exr_context_t *x, struct exr_stream *s, const unsigned char *bytes, size_t size, struct error *e);
int exr_open_write(exr_context_t *x, struct exr_stream *s, size_t room, struct error *e);
/* rc: the library's result; anything but success drops the bytes. Closes x. */
int exr_close_write(exr_context_t *x, struct exr_stream *s, exr_result_t rc, unsigned char **bytes, size_t *size,
		    struct error *e);
/* -EBADMSG, or -ENOMEM if that is the cause, with the library's message. */
int exr_failed(const struct exr_stream *s, exr_result_t rc, struct error *e);
/* Checks that sides are at most EXR_MAX_SIDE. */
exr_attr_box2i_t exr_box(uint32_t x, uint32_t y, uint32_t width, uint32_t height);

#endif
