/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Uncompressed Windows bitmaps: palettes of 1, 4 and 8 bits, and 24 and 32 bits per pixel, from bottom to top or, with
 * a negative height, from top to bottom. A palette of greys gives one channel. Alpha is not read, because most writers
 * leave 0 there.
 *
 * Failures: -EBADMSG for a file that contradicts itself or ends too early, -ENOTSUP for compression, 16 bits and
 * unusual masks.
 */
#include "worker/render/image/image_decode.h"
#include "common/base/bytes.h"

enum { FILE_HEADER = 14, CORE_HEADER = 12, INFO_HEADER = 40, PLAIN = 0, MASKED = 3 };

struct bmp {
	const struct image_input *in;
	uint64_t width, height;
	bool down; /* rows from top to bottom */
	uint32_t bits, pixels_at;
	const unsigned char *palette;
	uint32_t colours, entry; /* entries, and bytes per entry: blue, green, red */
};

static int read_palette(struct bmp *b, uint32_t header, uint32_t used)
{
	if (b->bits > 8)
		return 0;
	b->entry = header == CORE_HEADER ? 3 : 4;
	b->colours = used ? used : 1u << b->bits;
	uint64_t end = FILE_HEADER + (uint64_t)header + (uint64_t)b->colours * b->entry;
	if (b->colours > 1u << b->bits || end > b->pixels_at || end > b->in->size)
		return error_set(b->in->error, EBADMSG, "BMP: a palette that overlaps the pixels");
	b->palette = b->in->bytes + FILE_HEADER + header;
	return 0;
}

/* Returns whether the masks of a 32-bit image are the default ones; no others are accepted. */
static bool masks_are_usual(const struct bmp *b)
{
	const unsigned char *p = b->in->bytes + FILE_HEADER + INFO_HEADER;
	return b->in->size >= FILE_HEADER + INFO_HEADER + 12 && b->bits == 32 && get32(p) == 0xff0000 &&
	       get32(p + 4) == 0xff00 && get32(p + 8) == 0xff;
}

static int read_header(struct bmp *b)
{
	const unsigned char *p = b->in->bytes;
	if (b->in->size < FILE_HEADER + CORE_HEADER)
		return error_set(b->in->error, EBADMSG, "BMP: the header ends too early");
	uint32_t header = get32(p + FILE_HEADER), compression = PLAIN, used = 0;
	b->pixels_at = get32(p + 10);
	if (header != CORE_HEADER && (header < INFO_HEADER || header > b->in->size - FILE_HEADER))
		return error_set(b->in->error, EBADMSG, "BMP: a header of an unknown size");
	if (header == CORE_HEADER) {
		b->width = get16(p + 18);
		b->height = get16(p + 20);
		b->bits = get16(p + 24);
	} else {
		int32_t height = (int32_t)get32(p + 22);
		b->width = get32(p + 18);
		b->down = height < 0;
		b->height = (uint64_t)(height < 0 ? -(int64_t)height : height);
		b->bits = get16(p + 28);
		compression = get32(p + 30);
		used = get32(p + 46);
	}
	if (compression != PLAIN && !(compression == MASKED && masks_are_usual(b)))
		return error_set(b->in->error, ENOTSUP, "BMP: compressed images and unusual masks are not supported");
	if (b->bits != 1 && b->bits != 4 && b->bits != 8 && b->bits != 24 && b->bits != 32)
		return error_set(b->in->error, ENOTSUP, "BMP: %u bits per pixel", b->bits);
	return read_palette(b, header, used);
}

/* Returns the blue, green and red bytes of pixel x of a row; NULL if its index is beyond the palette. */
static const unsigned char *pixel_at(const struct bmp *b, const unsigned char *row, uint64_t x)
{
	if (!b->palette)
		return row + x * (b->bits / 8);
	uint64_t bit = x * b->bits;
	uint32_t i = (uint32_t)row[bit / 8] >> (8 - b->bits - bit % 8) & ((1u << b->bits) - 1);
	return i < b->colours ? b->palette + (size_t)i * b->entry : NULL;
}

static bool is_grey(const struct bmp *b)
{
	for (uint32_t i = 0; i < b->colours; i++) {
		const unsigned char *c = b->palette + (size_t)i * b->entry;
		if (c[0] != c[1] || c[0] != c[2])
			return false;
	}
	return b->palette != NULL;
}

static int decode(const struct image_input *in, struct image *out)
{
	struct bmp b = {.in = in};
	float value[256];
	int r = read_header(&b);
	if (r)
		return r;
	uint32_t channels = is_grey(&b) ? 1 : 3;
	bool bounded = b.width <= IMAGE_PIXELS_MAX && b.height <= IMAGE_PIXELS_MAX;
	uint64_t stride = bounded ? (b.width * b.bits + 31) / 32 * 4 : 0;
	r = image_allocate(in, out, b.width, b.height, channels, stride * b.height);
	if (r)
		return r;
	if (b.pixels_at > in->size || stride * b.height > in->size - b.pixels_at)
		return error_set(in->error, EBADMSG, "BMP: the file ends too early");
	image_table(value, 255, in->raw);
	float *to = out->pixels;
	for (uint64_t y = 0; y < b.height; y++) {
		const unsigned char *row = in->bytes + b.pixels_at + (b.down ? y : b.height - 1 - y) * stride;
		for (uint64_t x = 0; x < b.width; x++, to += channels) {
			const unsigned char *c = pixel_at(&b, row, x);
			if (!c)
				return error_set(in->error, EBADMSG, "BMP: a pixel beyond the palette");
			for (uint32_t k = 0; k < channels; k++)
				to[k] = value[c[2 - k]];
		}
	}
	return 0;
}

const struct image_format image_format_bmp = {
	.begins = {"BM"},
	.decode = decode,
};
