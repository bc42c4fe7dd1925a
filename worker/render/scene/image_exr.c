/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/image_decode.h"

#include "common/exr/exr_dwa.h"
#include "common/exr/exr_read.h"

#include <math.h>

static int copy_planes(const struct image_input *in, const struct exr_image *x, struct image *out)
{
	static const char *const rgb[3] = {"R", "G", "B"};
	uint32_t channels = exr_plane(x, "R") || !exr_plane(x, "Y") ? 3 : 1;
	const float *planes[3] = {channels == 1 ? exr_plane(x, "Y") : NULL};
	for (uint32_t k = 0; channels == 3 && k < 3; k++)
		if (!(planes[k] = exr_plane(x, rgb[k])))
			return error_set(in->error, EINVAL, "%s: OpenEXR without channel %s; R, G, B or Y are required",
					 in->name, rgb[k]);
	int r = image_allocate(in, out, x->width, x->height, channels, 0);
	for (size_t i = 0; !r && i < (size_t)x->width * x->height; i++)
		for (uint32_t k = 0; k < channels; k++) {
			if (!isfinite(planes[k][i]))
				return error_set(in->error, EBADMSG, "%s: OpenEXR: pixel (%zu, %zu) is not finite",
						 in->name, i % x->width, i / x->width);
			out->pixels[channels * i + k] = planes[k][i];
		}
	return r;
}

int image_decode_exr(const struct image_input *in, struct image *out)
{
	struct exr_image x = {0};
	int r = exr_read_within(in->bytes, in->size, IMAGE_BYTES_MAX, &x, in->error);
	if (r == -ENOTSUP)
		r = exr_read_dwa(in->bytes, in->size, IMAGE_BYTES_MAX, &x, in->error);
	if (r)
		return error_prefix(in->error, r, "%s", in->name);
	r = copy_planes(in, &x, out);
	exr_image_fini(&x);
	return r;
}
