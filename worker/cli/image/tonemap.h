/* SPDX-License-Identifier: Apache-2.0 */
/* Linear light to bytes for displays: exposure, the sRGB curve (IEC 61966-2-1), clipping. Pure; any thread. */
#ifndef WORKER_CLI_IMAGE_TONEMAP_H
#define WORKER_CLI_IMAGE_TONEMAP_H

#include <stddef.h>

/* Values that cannot be displayed. */
struct tonemap_counts {
	size_t nan, infinite; /* shown as 0; as 0 or 255 by their sign */
	size_t above, below;  /* finite; clipped to 255 and to 0 */
};

/* [0,1] to [0,1]. */
double tonemap_srgb(double linear);

/* stops: values are multiplied by 2^stops. out: 3 bytes per pixel. */
struct tonemap_counts tonemap(const float *const rgb[3], size_t pixels, double stops, unsigned char *out);

#endif
