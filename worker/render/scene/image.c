/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/image.h"

#include "common/base/color.h"

#include "worker/render/scene/image_decode.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const struct format {
	const char *magic;
	size_t size;
	int (*decode)(const struct image_input *in, struct image *out);
	enum { NOT_READ, READ, OPAQUE } alpha; /* OPAQUE: the format has none */
} formats[] = {
	{"\x89PNG\r\n\x1a\n", 8, image_decode_png, READ},
	{"\xff\xd8\xff", 3, image_decode_jpeg, OPAQUE},
	{"\x76\x2f\x31\x01", 4, image_decode_exr, NOT_READ},
	{"#?RADIANCE", 10, image_decode_hdr, NOT_READ},
	{"#?RGBE", 6, image_decode_hdr, NOT_READ},
	{"RIFF", 4, image_decode_webp, READ},
	{"BM", 2, image_decode_bmp, NOT_READ},
	{"P5", 2, image_decode_pnm, NOT_READ},
	{"P6", 2, image_decode_pnm, NOT_READ},
	{"PF", 2, image_decode_pnm, NOT_READ},
	{"Pf", 2, image_decode_pnm, NOT_READ},
};

/* A grey value as three equal ones, in place. */
static void keep_channel(struct image *img, enum image_channel channel)
{
	size_t count = (size_t)img->width * img->height;
	if (img->channels != 3)
		return;
	for (size_t i = 0; i < count; i++)
		img->pixels[i] = img->pixels[3 * i + (size_t)(channel - IMAGE_RED)];
	img->channels = 1;
}

void image_grey(struct image *i, enum image_channel as)
{
	size_t count = (size_t)i->width * i->height;
	if (i->channels != 3)
		return;
	for (size_t k = 0; k < count; k++) {
		const float *p = i->pixels + 3 * k;
		const double rgb[3] = {(double)p[0], (double)p[1], (double)p[2]};
		bool same = p[0] == p[1] && p[0] == p[2]; /* and stays so */
		i->pixels[k] = same		  ? p[0]
			       : as == IMAGE_MEAN ? (float)((rgb[0] + rgb[1] + rgb[2]) / 3)
						  : (float)rec709_luminance(rgb);
	}
	i->channels = 1;
}

/* The alpha of an image of a format that has none. */
static void make_opaque(struct image *img)
{
	for (size_t i = 0; i < (size_t)img->width * img->height; i++)
		img->pixels[i] = 1;
	img->channels = 1;
}

static int decode(const struct image_input *in, struct image *out)
{
	for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
		if (in->size < formats[i].size || memcmp(in->bytes, formats[i].magic, formats[i].size) != 0)
			continue;
		if (in->alpha && formats[i].alpha == NOT_READ)
			return error_set(in->error, ENOTSUP, "alpha is only read from PNG, WebP and TGA");
		int r = formats[i].decode(in, out);
		if (!r && in->alpha && formats[i].alpha == OPAQUE)
			make_opaque(out);
		return r;
	}
	if (image_is_tga(in)) /* the only one without a beginning of its own */
		return image_decode_tga(in, out);
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
		keep_channel(out, channel);
	return 0;
}

enum image_channel image_channel_named(const char *name)
{
	static const char letters[] = "rgba";
	const char *at = name[0] && !name[1] ? strchr(letters, *name) : NULL;
	return at ? (enum image_channel)(IMAGE_RED + (at - letters)) : IMAGE_ALL;
}

int image_power(struct image *i, double power, struct error *e)
{
	size_t count = (size_t)i->width * i->height * i->channels;
	if (power == 1)
		return 0;
	for (size_t k = 0; k < count; k++) {
		double x = (double)i->pixels[k], size = fabs(x);
		if (size > 1 && power * log2(size) >= FLT_MAX_EXP - 1)
			return error_set(e, ERANGE, "gamma = %g makes a number that is too large: %g to that power",
					 power, size);
		i->pixels[k] = (float)copysign(pow(size, power), x);
	}
	return 0;
}
