/* SPDX-License-Identifier: Apache-2.0 */
/* A decoded image: linear Rec. 709 floats, rows from top to bottom. */
#ifndef WORKER_RENDER_IMAGE_IMAGE_PIXELS_H
#define WORKER_RENDER_IMAGE_IMAGE_PIXELS_H

#include <stdint.h>

struct image {
	uint32_t width, height, channels; /* channels: 1 or 3; alpha is dropped, or is the only channel */
	float *pixels;			  /* [height][width][channels], all finite; allocated in the arena */
};

#endif
