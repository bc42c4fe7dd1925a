/* SPDX-License-Identifier: Apache-2.0 */
/* Converts linear light to bytes for displays: exposure, the sRGB curve (IEC 61966-2-1), clipping. Pure; any thread. */
#ifndef WORKER_CLI_IMAGE_TONEMAP_H
#define WORKER_CLI_IMAGE_TONEMAP_H

#include <stddef.h>

/* Numbers of values that cannot be displayed as they are. */
struct tonemap_counts {
	size_t nan, infinite; /* NaN, shown as 0; infinities, shown as 0 or 255 by their sign */
	size_t above, below;  /* finite values, clipped to 255 and to 0 */
};

/* Returns the sRGB value in [0,1] of linear light in [0,1]. */
double tonemap_srgb(double linear);

/* Converts an image, multiplied by 2^stops. out: 3 bytes per pixel. */
struct tonemap_counts tonemap_image(const float *const rgb[3], size_t pixels, double stops, unsigned char *out);

#endif
