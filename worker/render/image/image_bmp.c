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

enum {
	FILE_HEADER_SIZE = 14,
	CORE_HEADER_SIZE = 12,
	INFO_HEADER_SIZE = 40,
	COMPRESSION_NONE = 0,
	COMPRESSION_BITFIELDS = 3
};

struct bmp {
	const struct image_input *in;
	uint64_t width, height;
	bool is_top_down;
	uint32_t bits_per_pixel, pixel_offset;
	const unsigned char *palette;
	uint32_t colour_count, entry_size; /* entries of the palette, and bytes per entry: blue, green, red */
};

static int read_palette(struct bmp *b, uint32_t header_size, uint32_t used_colours)
{
	if (b->bits_per_pixel > 8)
		return 0;
	b->entry_size = header_size == CORE_HEADER_SIZE ? 3 : 4;
	b->colour_count = used_colours ? used_colours : 1u << b->bits_per_pixel;
	uint64_t end = FILE_HEADER_SIZE + (uint64_t)header_size + (uint64_t)b->colour_count * b->entry_size;
	if (b->colour_count > 1u << b->bits_per_pixel || end > b->pixel_offset || end > b->in->size)
		return error_set(b->in->error, EBADMSG, "BMP: a palette that overlaps the pixels");
	b->palette = b->in->bytes + FILE_HEADER_SIZE + header_size;
	return 0;
}

/* Returns whether the masks of a 32-bit image are the default ones; no others are accepted. */
static bool has_default_masks(const struct bmp *b)
{
	const unsigned char *p = b->in->bytes + FILE_HEADER_SIZE + INFO_HEADER_SIZE;
	return b->in->size >= FILE_HEADER_SIZE + INFO_HEADER_SIZE + 12 && b->bits_per_pixel == 32 &&
	       get32(p) == 0xff0000 && get32(p + 4) == 0xff00 && get32(p + 8) == 0xff;
}

static int read_header(struct bmp *b)
{
	const unsigned char *p = b->in->bytes;
	if (b->in->size < FILE_HEADER_SIZE + CORE_HEADER_SIZE)
		return error_set(b->in->error, EBADMSG, "BMP: the header ends too early");
	uint32_t header_size = get32(p + FILE_HEADER_SIZE), compression = COMPRESSION_NONE, used_colours = 0;
	b->pixel_offset = get32(p + 10);
	if (header_size != CORE_HEADER_SIZE &&
	    (header_size < INFO_HEADER_SIZE || header_size > b->in->size - FILE_HEADER_SIZE))
		return error_set(b->in->error, EBADMSG, "BMP: a header of an unknown size");
	if (header_size == CORE_HEADER_SIZE) {
		b->width = get16(p + 18);
		b->height = get16(p + 20);
		b->bits_per_pixel = get16(p + 24);
	} else {
		int32_t height = (int32_t)get32(p + 22);
		b->width = get32(p + 18);
		b->is_top_down = height < 0;
		b->height = (uint64_t)(height < 0 ? -(int64_t)height : height);
		b->bits_per_pixel = get16(p + 28);
		compression = get32(p + 30);
		used_colours = get32(p + 46);
	}
	if (compression != COMPRESSION_NONE && !(compression == COMPRESSION_BITFIELDS && has_default_masks(b)))
		return error_set(b->in->error, ENOTSUP, "BMP: compressed images and unusual masks are not supported");
	if (b->bits_per_pixel != 1 && b->bits_per_pixel != 4 && b->bits_per_pixel != 8 && b->bits_per_pixel != 24 &&
	    b->bits_per_pixel != 32)
		return error_set(b->in->error, ENOTSUP, "BMP: %u bits per pixel", b->bits_per_pixel);
	return read_palette(b, header_size, used_colours);
}

/* Returns the blue, green and red bytes of pixel x of a row; NULL if its index is beyond the palette. */
static const unsigned char *pixel_at(const struct bmp *b, const unsigned char *row, uint64_t x)
{
	if (!b->palette)
		return row + x * (b->bits_per_pixel / 8);
	uint64_t bit = x * b->bits_per_pixel;
	uint32_t i = (uint32_t)row[bit / 8] >> (8 - b->bits_per_pixel - bit % 8) & ((1u << b->bits_per_pixel) - 1);
	return i < b->colour_count ? b->palette + (size_t)i * b->entry_size : NULL;
}

static bool is_grey(const struct bmp *b)
{
	for (uint32_t i = 0; i < b->colour_count; i++) {
		const unsigned char *c = b->palette + (size_t)i * b->entry_size;
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
	bool is_bounded = b.width <= IMAGE_PIXELS_MAX && b.height <= IMAGE_PIXELS_MAX;
	uint64_t stride = is_bounded ? (b.width * b.bits_per_pixel + 31) / 32 * 4 : 0;
	r = image_allocate(in, out, b.width, b.height, channels, stride * b.height);
	if (r)
		return r;
	if (b.pixel_offset > in->size || stride * b.height > in->size - b.pixel_offset)
		return error_set(in->error, EBADMSG, "BMP: the file ends too early");
	image_fill_sample_table(value, 255, in->is_raw);
	float *pixel = out->pixels;
	for (uint64_t y = 0; y < b.height; y++) {
		const unsigned char *row = in->bytes + b.pixel_offset + (b.is_top_down ? y : b.height - 1 - y) * stride;
		for (uint64_t x = 0; x < b.width; x++, pixel += channels) {
			const unsigned char *c = pixel_at(&b, row, x);
			if (!c)
				return error_set(in->error, EBADMSG, "BMP: a pixel beyond the palette");
			for (uint32_t k = 0; k < channels; k++)
				pixel[k] = value[c[2 - k]];
		}
	}
	return 0;
}

const struct image_format image_format_bmp = {
	.signatures = {"BM"},
	.decode = decode,
};
