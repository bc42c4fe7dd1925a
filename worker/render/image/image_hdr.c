/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Radiance images: mantissas of red, green and blue with a common exponent (Ward 1991, Real Pixels), stored flat or
 * run-length encoded by component. As in Mitsuba, EXPOSURE is not applied.
 */
#include "worker/render/image/image_decode.h"

#include "common/base/mem.h"
#include "worker/render/text/number.h"

#include <math.h>
#include <string.h>

enum { LINE_BYTES_MAX = 1024, RLE_WIDTH_MIN = 8, RLE_WIDTH_MAX = 32767 };

struct cursor {
	const struct image_input *in;
	const unsigned char *p, *end;
};

static bool read_line(struct cursor *c, char line[LINE_BYTES_MAX])
{
	const unsigned char *newline = memchr(c->p, '\n', (size_t)(c->end - c->p));
	size_t n = newline ? (size_t)(newline - c->p) : 0;
	if (!newline || n >= LINE_BYTES_MAX)
		return false;
	memcpy(line, c->p, n);
	line[n] = 0;
	if (n && line[n - 1] == '\r')
		line[n - 1] = 0;
	c->p = newline + 1;
	return true;
}

static const char *read_extent(const char *text, const char *axis, int64_t *out)
{
	size_t n = strlen(axis);
	if (strncmp(text, axis, n) != 0)
		return NULL;
	return number_scan_int(text + n, text + strlen(text), out);
}

static int read_header(struct cursor *c, int64_t *width, int64_t *height)
{
	char line[LINE_BYTES_MAX];
	do {
		if (!read_line(c, line))
			return error_set(c->in->error, EBADMSG, "Radiance HDR: the header does not end");
		if (strncmp(line, "FORMAT=", 7) == 0 && strcmp(line + 7, "32-bit_rle_rgbe") != 0)
			return error_set(c->in->error, EBADMSG,
					 "Radiance HDR: only FORMAT=32-bit_rle_rgbe is supported");
	} while (line[0]);
	const char *rest;
	if (!read_line(c, line) || !(rest = read_extent(line, "-Y ", height)) ||
	    !(rest = read_extent(rest, " +X ", width)) || *rest || *width < 1 || *height < 1)
		return error_set(c->in->error, EBADMSG,
				 "Radiance HDR: only the resolution line \"-Y height +X width\" is supported");
	return 0;
}

/* Decodes one component of a scan line: a count above 128 repeats the next byte count - 128 times, a count up to 128
 * copies that many bytes. */
static bool read_runs(struct cursor *c, unsigned char *out, size_t n)
{
	size_t i = 0;
	while (i < n) {
		if (c->end - c->p < 2)
			return false;
		size_t count = *c->p++;
		if (count > 128) {
			count -= 128;
			if (count > n - i)
				return false;
			memset(out + i, *c->p++, count);
		} else {
			if (count == 0 || count > n - i || count > (size_t)(c->end - c->p))
				return false;
			memcpy(out + i, c->p, count);
			c->p += count;
		}
		i += count;
	}
	return true;
}

static void store_pixel(float out[3], unsigned r, unsigned g, unsigned b, unsigned exponent)
{
	float scale = exponent ? ldexpf(1, (int)exponent - (128 + 8)) : 0;
	out[0] = (float)r * scale;
	out[1] = (float)g * scale;
	out[2] = (float)b * scale;
}

static int read_uncompressed(struct cursor *c, float *out, size_t width)
{
	if ((size_t)(c->end - c->p) / 4 < width)
		return error_set(c->in->error, EBADMSG, "Radiance HDR: the file ends too early");
	for (size_t x = 0; x < width; x++, c->p += 4) {
		if (c->p[0] == 1 && c->p[1] == 1 && c->p[2] == 1)
			return error_set(c->in->error, EBADMSG,
					 "Radiance HDR: the old run-length encoding is not supported");
		store_pixel(out + 3 * x, c->p[0], c->p[1], c->p[2], c->p[3]);
	}
	return 0;
}

static int read_row(struct cursor *c, unsigned char *planes, float *out, size_t width)
{
	bool is_run_length_encoded = width >= RLE_WIDTH_MIN && width <= RLE_WIDTH_MAX && c->end - c->p >= 4 &&
				     c->p[0] == 2 && c->p[1] == 2 && c->p[2] < 128;
	if (!is_run_length_encoded)
		return read_uncompressed(c, out, width);
	if (((size_t)c->p[2] << 8 | c->p[3]) != width)
		return error_set(c->in->error, EBADMSG, "Radiance HDR: a scan line whose width is not the image's");
	c->p += 4;
	for (size_t k = 0; k < 4; k++)
		if (!read_runs(c, planes + k * width, width))
			return error_set(c->in->error, EBADMSG,
					 "Radiance HDR: run lengths that do not fill a scan line");
	for (size_t x = 0; x < width; x++)
		store_pixel(out + 3 * x, planes[x], planes[width + x], planes[2 * width + x], planes[3 * width + x]);
	return 0;
}

static int decode(const struct image_input *in, struct image *out)
{
	struct cursor c = {in, in->bytes, in->bytes + in->size};
	int64_t width, height;
	int r = read_header(&c, &width, &height);
	/* The best compression stores 127 values of a component in two bytes. */
	uint64_t w = r ? 0 : (uint64_t)width, h = r ? 0 : (uint64_t)height;
	if (!r)
		r = image_allocate(in, out, w, h, 3,
				   w <= IMAGE_PIXELS_MAX && h <= IMAGE_PIXELS_MAX ? w * h / 127 * 8 : 0);
	if (r)
		return r;
	unsigned char *planes = mem_alloc(4, w);
	if (!planes)
		return error_set(in->error, ENOMEM, "out of memory");
	for (uint64_t y = 0; y < h && !r; y++)
		r = read_row(&c, planes, out->pixels + 3 * w * y, w);
	mem_free(planes);
	return r;
}

const struct image_format image_format_hdr = {
	.signatures = {"#?RADIANCE", "#?RGBE"},
	.decode = decode,
};
