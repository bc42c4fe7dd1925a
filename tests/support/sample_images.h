/* SPDX-License-Identifier: Apache-2.0 */
/* Small valid pictures in memory, made by the libraries' encoders. Free with free(). */
#ifndef TESTS_SUPPORT_SAMPLE_IMAGES_H
#define TESTS_SUPPORT_SAMPLE_IMAGES_H

#include <stddef.h>

enum sample_pixels { SAMPLE_GREY, SAMPLE_RGB, SAMPLE_RGBA, SAMPLE_PALETTE };

/* Component k of pixel (x, y) has the value sample_value(x, y, k) with 8 bits, or 257 times that with 16. */
unsigned sample_value(size_t x, size_t y, int k);
unsigned char *sample_png(size_t width, size_t height, enum sample_pixels kind, int bits, int interlaced, size_t *size);
/* All pixels have one colour, which JPEG preserves to a step or two. */
unsigned char *sample_jpeg(size_t width, size_t height, const unsigned char *color, int components, int progressive,
			   size_t *size);

#endif
