/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Truevision's TGA: 8-bit grey, 24-bit and 32-bit colour, and palettes of such colours with 8-bit indices; uncompressed
 * or run-length encoded, starting at any corner. A run may continue into the next row.
 *
 * A TGA file has no signature at its beginning. A file counts as TGA if its name ends in .tga, or if it ends with the
 * signature of version 2.
 *
 * Failures: -EBADMSG for a file that contradicts itself or ends too early, -ENOTSUP for 15 and 16 bits, interleaved
 * rows and other kinds of pixels.
 */
#include "worker/render/image/image_decode.h"
#include "common/base/bytes.h"
#include "common/base/picture_name.h"

enum { HEADER_SIZE = 18, KIND_PALETTE = 1, KIND_COLOUR = 2, KIND_GREY = 3, KIND_RLE_FLAG = 8 };

struct tga {
	const struct image_input *in;
	uint32_t width, height, kind, pixel_bytes; /* pixel_bytes: with a palette, per index */
	bool is_rle, is_top_down, is_right_to_left;
	const unsigned char *palette; /* the palette; NULL: the pixels are colours */
	uint32_t palette_first, palette_count, palette_entry_bytes;
	const unsigned char *cursor; /* next unread byte */
	/* The current run-length packet: */
	uint32_t packet_remaining;
	const unsigned char *repeated_pixel; /* the pixel that the packet repeats; NULL: each pixel is stored */
};

static bool is_tga(const struct image_input *in)
{
	static const char signature[] = "TRUEVISION-XFILE."; /* followed by its terminating 0 */
	const char *format = picture_name_format(in->name);
	return (format && strcmp(format, ".tga") == 0) ||
	       (in->size >= HEADER_SIZE + sizeof signature &&
		memcmp(in->bytes + in->size - sizeof signature, signature, sizeof signature) == 0);
}

static size_t remaining_bytes(const struct tga *t)
{
	return t->in->size - (size_t)(t->cursor - t->in->bytes);
}

static int read_palette(struct tga *t, const unsigned char *header)
{
	uint32_t bits = header[7];
	uint64_t size = (uint64_t)get16(header + 5) * ((bits + 7) / 8);
	if (header[1] > 1 || (t->kind == KIND_PALETTE && header[1] == 0))
		return error_set(t->in->error, EBADMSG, "TGA: the palette is missing or of an unknown kind");
	if (header[1] == 0)
		return 0;
	if (size > remaining_bytes(t))
		return error_set(t->in->error, EBADMSG, "TGA: the palette ends too early");
	if (t->kind == KIND_PALETTE) {
		if (bits != 24 && bits != 32)
			return error_set(t->in->error, ENOTSUP, "TGA: a palette of %u bits", bits);
		t->palette = t->cursor;
		t->palette_entry_bytes = bits / 8;
		t->palette_first = get16(header + 3);
		t->palette_count = get16(header + 5);
	}
	t->cursor += size;
	return 0;
}

static int read_header(struct tga *t)
{
	const unsigned char *p = t->in->bytes;
	if (t->in->size < HEADER_SIZE || (size_t)HEADER_SIZE + p[0] > t->in->size)
		return error_set(t->in->error, EBADMSG, "TGA: the header ends too early");
	t->kind = p[2] & ~(uint32_t)KIND_RLE_FLAG;
	t->is_rle = p[2] & KIND_RLE_FLAG;
	t->width = get16(p + 12);
	t->height = get16(p + 14);
	t->pixel_bytes = p[16] / 8;
	t->is_right_to_left = p[17] & 0x10;
	t->is_top_down = p[17] & 0x20;
	t->cursor = p + HEADER_SIZE + p[0];
	bool is_true_colour = t->kind == KIND_COLOUR && (p[16] == 24 || p[16] == 32);
	bool is_one_byte = (t->kind == KIND_GREY || t->kind == KIND_PALETTE) && p[16] == 8;
	if (!is_true_colour && !is_one_byte)
		return error_set(t->in->error, ENOTSUP, "TGA: pixels of kind %u with %u bits", p[2], p[16]);
	if (p[17] & 0xc0)
		return error_set(t->in->error, ENOTSUP, "TGA: interleaved rows");
	return read_palette(t, p);
}

static const unsigned char *read_bytes(struct tga *t, size_t bytes)
{
	const unsigned char *p = t->cursor;
	if (remaining_bytes(t) < bytes)
		return NULL;
	t->cursor += bytes;
	return p;
}

/* Returns the bytes of the next pixel: blue, green, red and perhaps alpha, or grey. NULL if the file ends too early
 * or the index is beyond the palette. */
static const unsigned char *next_pixel(struct tga *t)
{
	if (t->is_rle && t->packet_remaining == 0) {
		const unsigned char *packet = read_bytes(t, 1);
		if (!packet)
			return NULL;
		t->packet_remaining = (*packet & 0x7fu) + 1;
		t->repeated_pixel = NULL;
		if ((*packet & 0x80) && !(t->repeated_pixel = read_bytes(t, t->pixel_bytes)))
			return NULL;
	}
	if (t->is_rle)
		t->packet_remaining--;
	const unsigned char *p = t->is_rle && t->repeated_pixel ? t->repeated_pixel : read_bytes(t, t->pixel_bytes);
	if (!p || !t->palette)
		return p;
	uint32_t i = *p - t->palette_first;
	return *p >= t->palette_first && i < t->palette_count ? t->palette + (size_t)i * t->palette_entry_bytes : NULL;
}

static int decode(const struct image_input *in, struct image *out)
{
	struct tga t = {.in = in};
	float value[256];
	int r = read_header(&t);
	if (r)
		return r;
	bool is_grey = t.kind == KIND_GREY, has_alpha = (t.palette ? t.palette_entry_bytes : t.pixel_bytes) == 4;
	uint32_t channels = is_grey || in->needs_only_alpha ? 1 : 3;
	uint64_t count = (uint64_t)t.width * t.height, min_rle_bytes = (count + 127) / 128 * (1 + t.pixel_bytes);
	r = image_allocate(in, out, t.width, t.height, channels, t.is_rle ? min_rle_bytes : count * t.pixel_bytes);
	if (r)
		return r;
	image_fill_sample_table(value, 255, in->is_raw || in->needs_only_alpha);
	for (uint32_t j = 0; j < t.height; j++)
		for (uint32_t i = 0; i < t.width; i++) {
			uint32_t x = t.is_right_to_left ? t.width - 1 - i : i, y = t.is_top_down ? j : t.height - 1 - j;
			float *pixel = out->pixels + ((size_t)y * t.width + x) * channels;
			const unsigned char *c = next_pixel(&t);
			if (!c)
				return error_set(in->error, EBADMSG,
						 "TGA: the file ends too early, or a pixel is beyond the palette");
			if (in->needs_only_alpha)
				*pixel = has_alpha ? value[c[3]] : 1;
			else if (is_grey)
				*pixel = value[c[0]];
			else
				for (int k = 0; k < 3; k++)
					pixel[k] = value[c[2 - k]];
		}
	return 0;
}

const struct image_format image_format_tga = {
	.matches = is_tga,
	.decode = decode,
	.alpha_support = IMAGE_ALPHA_READ,
};
