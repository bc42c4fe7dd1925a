/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/image/image.h"

#include "common/base/color.h"

#include "worker/render/image/image_decode.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define FORMAT(name) extern const struct image_format image_format_##name;
#include "worker/render/image/image_formats.h"
#undef FORMAT

static const struct image_format *const formats[] = {
#define FORMAT(name) &image_format_##name,
#include "worker/render/image/image_formats.h"
#undef FORMAT
};

/* Reduces the image to one channel, in place. A grey image stays as it is: its value counts for each channel. */
static void extract_channel(struct image *img, enum image_channel channel)
{
	size_t count = (size_t)img->width * img->height;
	if (img->channels != 3)
		return;
	for (size_t i = 0; i < count; i++)
		img->pixels[i] = img->pixels[3 * i + (size_t)(channel - IMAGE_RED)];
	img->channels = 1;
}

void image_convert_to_grey(struct image *i, enum image_channel channel)
{
	size_t count = (size_t)i->width * i->height;
	if (i->channels != 3)
		return;
	for (size_t k = 0; k < count; k++) {
		const float *p = i->pixels + 3 * k;
		const double rgb[3] = {(double)p[0], (double)p[1], (double)p[2]};
		/* Equal channels keep their exact value, free of rounding. */
		bool is_grey = p[0] == p[1] && p[0] == p[2];
		i->pixels[k] = is_grey		       ? p[0]
			       : channel == IMAGE_MEAN ? (float)((rgb[0] + rgb[1] + rgb[2]) / 3)
						       : (float)rec709_luminance(rgb);
	}
	i->channels = 1;
}

/* Makes the alpha channel of an image whose format has none: 1 everywhere. */
static void make_opaque(struct image *img)
{
	for (size_t i = 0; i < (size_t)img->width * img->height; i++)
		img->pixels[i] = 1;
	img->channels = 1;
}

static bool format_matches(const struct image_format *f, const struct image_input *in)
{
	for (const char *const *b = f->signatures; *b; b++)
		if (in->size >= strlen(*b) && memcmp(in->bytes, *b, strlen(*b)) == 0)
			return true;
	return f->matches && f->matches(in);
}

static int decode(const struct image_input *in, struct image *out)
{
	for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
		const struct image_format *f = formats[i];
		if (!format_matches(f, in))
			continue;
		if (in->needs_only_alpha && f->alpha_support == IMAGE_ALPHA_NOT_READ)
			return error_set(in->error, ENOTSUP, "alpha is only read from PNG, WebP and TGA");
		int r = f->decode(in, out);
		if (!r && in->needs_only_alpha && f->alpha_support == IMAGE_ALPHA_NONE)
			make_opaque(out);
		return r;
	}
	return error_set(
		in->error, EINVAL,
		"unknown image format (supported: PNG, JPEG, WebP, OpenEXR, Radiance HDR, BMP, TGA, PGM, PPM, PFM)");
}

int image_decode(const unsigned char *bytes, size_t size, const char *name, bool raw, enum image_channel channel,
		 struct arena *arena, struct image *out, struct error *e)
{
	const struct image_input in = {name, bytes, size, raw, channel == IMAGE_ALPHA, arena, e};
	*out = (struct image){0};
	int r = decode(&in, out);
	if (r) {
		*out = (struct image){0};
		return error_prefix(e, r, "%s", name);
	}
	if (channel != IMAGE_ALL && channel != IMAGE_ALPHA)
		extract_channel(out, channel);
	return 0;
}

enum image_channel image_channel_named(const char *name)
{
	static const char letters[] = "rgba";
	const char *match = name[0] && !name[1] ? strchr(letters, *name) : NULL;
	return match ? (enum image_channel)(IMAGE_RED + (match - letters)) : IMAGE_ALL;
}

int image_apply_power(struct image *i, double power, struct error *e)
{
	size_t count = (size_t)i->width * i->height * i->channels;
	if (power == 1)
		return 0;
	for (size_t k = 0; k < count; k++) {
		double x = (double)i->pixels[k], magnitude = fabs(x);
		if (magnitude > 1 && power * log2(magnitude) >= FLT_MAX_EXP - 1)
			return error_set(e, ERANGE, "gamma = %g makes a number that is too large: %g to that power",
					 power, magnitude);
		i->pixels[k] = (float)copysign(pow(magnitude, power), x);
	}
	return 0;
}
