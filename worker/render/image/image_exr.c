/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/image/image_decode.h"

#include "common/exr/exr_dwa.h"
#include "common/exr/exr_read.h"
#include "worker/render/image/primaries.h"

#include <math.h>

static int copy_planes(const struct image_input *in, const struct exr_image *x, struct image *out)
{
	static const char *const rgb[3] = {"R", "G", "B"};
	uint32_t channels = exr_find_plane(x, "R") || !exr_find_plane(x, "Y") ? 3 : 1;
	const float *planes[3] = {channels == 1 ? exr_find_plane(x, "Y") : NULL};
	for (uint32_t k = 0; channels == 3 && k < 3; k++)
		if (!(planes[k] = exr_find_plane(x, rgb[k])))
			return error_set(in->error, EINVAL, "OpenEXR without channel %s; R, G, B or Y are required",
					 rgb[k]);
	int r = image_allocate(in, out, x->width, x->height, channels, 0);
	for (size_t i = 0; !r && i < (size_t)x->width * x->height; i++)
		for (uint32_t k = 0; k < channels; k++) {
			if (!isfinite(planes[k][i]))
				return error_set(in->error, EBADMSG, "OpenEXR: pixel (%zu, %zu) is not finite",
						 i % x->width, i / x->width);
			out->pixels[channels * i + k] = planes[k][i];
		}
	return r;
}

/* Converts colours given in another space, such as ACEScg, to BT.709. Colours outside BT.709's gamut get negative
 * values. */
static int convert_to_bt709(const struct image_input *in, const struct exr_image *x, struct image *out)
{
	struct primaries p;
	double m[3][3];
	if (!x->has_primaries || out->channels != 3)
		return 0;
	for (int k = 0; k < 4; k++) {
		p.x[k] = x->primaries[2 * k];
		p.y[k] = x->primaries[2 * k + 1];
	}
	if (primaries_are_bt709(&p))
		return 0;
	if (!primaries_to_bt709(&p, m))
		return error_set(in->error, EBADMSG, "OpenEXR: no colours have the chromaticities in its header");
	for (size_t i = 0; i < (size_t)out->width * out->height; i++) {
		float *pixel = out->pixels + 3 * i;
		const double from[3] = {pixel[0], pixel[1], pixel[2]};
		for (int k = 0; k < 3; k++) {
			pixel[k] = (float)(m[k][0] * from[0] + m[k][1] * from[1] + m[k][2] * from[2]);
			if (!isfinite(pixel[k]))
				return error_set(in->error, EBADMSG,
						 "OpenEXR: pixel (%zu, %zu) is not finite in BT.709", i % out->width,
						 i / out->width);
		}
	}
	return 0;
}

static int decode(const struct image_input *in, struct image *out)
{
	struct exr_image x = {0};
	int r = exr_read_limited(in->bytes, in->size, IMAGE_BYTES_MAX, &x, in->error);
	if (r == -ENOTSUP)
		r = exr_read_dwa(in->bytes, in->size, IMAGE_BYTES_MAX, &x, in->error);
	if (r)
		return r;
	r = copy_planes(in, &x, out);
	if (!r)
		r = convert_to_bt709(in, &x, out);
	exr_image_fini(&x);
	return r;
}

const struct image_format image_format_exr = {
	.signatures = {"\x76\x2f\x31\x01"},
	.decode = decode,
};
