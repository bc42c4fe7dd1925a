/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/image/tonemap.h"

#include <math.h>

double tonemap_srgb(double linear)
{
	return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}

static unsigned char display_byte(double value, struct tonemap_counts *n)
{
	if (isnan(value)) {
		n->nan++;
		return 0;
	}
	if (isinf(value))
		n->infinite++;
	else if (value > 1)
		n->above++;
	else if (value < 0)
		n->below++;
	if (value <= 0)
		return 0;
	return value >= 1 ? 255 : (unsigned char)(255 * tonemap_srgb(value) + 0.5);
}

struct tonemap_counts tonemap_image(const float *const rgb[3], size_t pixels, double stops, unsigned char *out)
{
	struct tonemap_counts n = {0};
	double factor = exp2(stops);
	for (size_t i = 0; i < pixels; i++)
		for (size_t k = 0; k < 3; k++)
			out[i * 3 + k] = display_byte((double)rgb[k][i] * factor, &n);
	return n;
}
