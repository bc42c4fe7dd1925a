/* SPDX-License-Identifier: Apache-2.0 */
/* WebP, lossy and lossless, decoded by libwebp. Other RIFF files, damaged files and animations are errors. */
#include "worker/render/image/image_decode.h"

#include <string.h>
#include <webp/decode.h>

static void store_pixels(const struct image_input *in, const uint8_t *rgba, struct image *out)
{
	float value[256];
	size_t count = (size_t)out->width * out->height;
	image_fill_sample_table(value, 255, in->is_raw || in->needs_only_alpha);
	for (size_t i = 0; i < count; i++)
		for (uint32_t k = 0; k < out->channels; k++)
			out->pixels[i * out->channels + k] = value[rgba[4 * i + (in->needs_only_alpha ? 3 : k)]];
}

static int decode(const struct image_input *in, struct image *out)
{
	WebPBitstreamFeatures features;
	if (in->size < 12 || memcmp(in->bytes + 8, "WEBP", 4) != 0)
		return error_set(in->error, EINVAL, "a RIFF file that is not a WebP image");
	if (WebPGetFeatures(in->bytes, in->size, &features) != VP8_STATUS_OK)
		return error_set(in->error, EBADMSG, "WebP: damaged, or cut off in its header");
	if (features.has_animation)
		return error_set(in->error, ENOTSUP, "WebP: an animation; supported: single images");
	/* No lower limit on the file's size: a lossless image of a single colour takes next to nothing. */
	int r = image_allocate(in, out, (uint64_t)features.width, (uint64_t)features.height,
			       in->needs_only_alpha ? 1 : 3, 0);
	if (r)
		return r;
	int width, height;
	uint8_t *rgba = WebPDecodeRGBA(in->bytes, in->size, &width, &height);
	if (!rgba)
		return error_set(in->error, EBADMSG, "WebP: damaged or cut off");
	if ((uint32_t)width == out->width && (uint32_t)height == out->height)
		store_pixels(in, rgba, out);
	else
		r = error_set(in->error, EBADMSG, "WebP: its header and its image differ in size");
	WebPFree(rgba);
	return r;
}

const struct image_format image_format_webp = {
	.signatures = {"RIFF"},
	.decode = decode,
	.alpha_support = IMAGE_ALPHA_READ,
};
