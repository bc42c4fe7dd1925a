/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/image/image_decode.h"

#include "worker/render/image/srgb.h"

int image_allocate(const struct image_input *in, struct image *out, uint64_t width, uint64_t height, uint32_t channels,
		   uint64_t min_file_bytes)
{
	if (width == 0 || height == 0 || width > IMAGE_PIXELS_MAX || height > IMAGE_PIXELS_MAX ||
	    width * height > IMAGE_PIXELS_MAX)
		return error_set(in->error, EFBIG, "%llu x %llu pixels; at most %d in all, and at least one",
				 (unsigned long long)width, (unsigned long long)height, IMAGE_PIXELS_MAX);
	if (in->size < min_file_bytes)
		return error_set(in->error, EBADMSG, "too short for %llu x %llu pixels", (unsigned long long)width,
				 (unsigned long long)height);
	*out = (struct image){.width = (uint32_t)width, .height = (uint32_t)height, .channels = channels};
	out->pixels = arena_alloc(in->arena, width * height, channels * sizeof *out->pixels);
	return out->pixels ? 0 : error_set(in->error, ENOMEM, "out of memory");
}

void image_fill_sample_table(float *table, uint32_t max, bool raw)
{
	for (uint32_t i = 0; i <= max; i++) {
		double x = (double)i / max;
		table[i] = (float)(raw ? x : srgb_to_linear(x));
	}
}
