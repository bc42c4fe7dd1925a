/* SPDX-License-Identifier: Apache-2.0 */
/* The decoding half of the sRGB transfer function (IEC 61966-2-1), extended beyond [0,1] as an odd function. */
#ifndef WORKER_RENDER_IMAGE_SRGB_H
#define WORKER_RENDER_IMAGE_SRGB_H

#include <math.h>

static inline double srgb_to_linear(double x)
{
	double a = fabs(x);
	return copysign(a <= 0.04045 ? a / 12.92 : pow((a + 0.055) / 1.055, 2.4), x);
}

#endif
