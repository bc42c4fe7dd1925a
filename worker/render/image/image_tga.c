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

enum { HEADER = 18, KIND_MAPPED = 1, KIND_COLOUR = 2, KIND_GREY = 3, KIND_PACKED = 8 };

struct tga {
	const struct image_input *in;
	uint32_t width, height, kind, bytes; /* bytes: per pixel, or per palette index */
	bool packed, down, leftwards;
	const unsigned char *map; /* the palette; NULL: the pixels are colours */
	uint32_t map_first, map_count, map_bytes;
	const unsigned char *at; /* next unread byte */
	/* The current run-length packet: */
	uint32_t left;
	const unsigned char *repeated; /* the pixel that the packet repeats; NULL: each pixel is stored */
};

static bool is_tga(const struct image_input *in)
{
	static const char signature[] = "TRUEVISION-XFILE."; /* followed by its terminating 0 */
	const char *format = picture_name_format(in->name);
	return (format && strcmp(format, ".tga") == 0) ||
	       (in->size >= HEADER + sizeof signature &&
		memcmp(in->bytes + in->size - sizeof signature, signature, sizeof signature) == 0);
}

static size_t bytes_left(const struct tga *t)
{
	return t->in->size - (size_t)(t->at - t->in->bytes);
}

static int read_map(struct tga *t, const unsigned char *header)
{
	uint32_t bits = header[7];
	uint64_t size = (uint64_t)get16(header + 5) * ((bits + 7) / 8);
	if (header[1] > 1 || (t->kind == KIND_MAPPED && header[1] == 0))
		return error_set(t->in->error, EBADMSG, "TGA: the palette is missing or of an unknown kind");
	if (header[1] == 0)
		return 0;
	if (size > bytes_left(t))
		return error_set(t->in->error, EBADMSG, "TGA: the palette ends too early");
	if (t->kind == KIND_MAPPED) {
		if (bits != 24 && bits != 32)
			return error_set(t->in->error, ENOTSUP, "TGA: a palette of %u bits", bits);
		t->map = t->at;
		t->map_bytes = bits / 8;
		t->map_first = get16(header + 3);
		t->map_count = get16(header + 5);
	}
	t->at += size;
	return 0;
}

static int read_header(struct tga *t)
{
	const unsigned char *p = t->in->bytes;
	if (t->in->size < HEADER || (size_t)HEADER + p[0] > t->in->size)
		return error_set(t->in->error, EBADMSG, "TGA: the header ends too early");
	t->kind = p[2] & ~(uint32_t)KIND_PACKED;
	t->packed = p[2] & KIND_PACKED;
	t->width = get16(p + 12);
	t->height = get16(p + 14);
	t->bytes = p[16] / 8;
	t->leftwards = p[17] & 0x10;
	t->down = p[17] & 0x20;
	t->at = p + HEADER + p[0];
	bool deep = t->kind == KIND_COLOUR && (p[16] == 24 || p[16] == 32);
	bool flat = (t->kind == KIND_GREY || t->kind == KIND_MAPPED) && p[16] == 8;
	if (!deep && !flat)
		return error_set(t->in->error, ENOTSUP, "TGA: pixels of kind %u with %u bits", p[2], p[16]);
	if (p[17] & 0xc0)
		return error_set(t->in->error, ENOTSUP, "TGA: interleaved rows");
	return read_map(t, p);
}

static const unsigned char *take_bytes(struct tga *t, size_t bytes)
{
	const unsigned char *p = t->at;
	if (bytes_left(t) < bytes)
		return NULL;
	t->at += bytes;
	return p;
}

/* Returns the bytes of the next pixel: blue, green, red and perhaps alpha, or grey. NULL if the file ends too early
 * or the index is beyond the palette. */
static const unsigned char *next_pixel(struct tga *t)
{
	if (t->packed && t->left == 0) {
		const unsigned char *packet = take_bytes(t, 1);
		if (!packet)
			return NULL;
		t->left = (*packet & 0x7fu) + 1;
		t->repeated = NULL;
		if ((*packet & 0x80) && !(t->repeated = take_bytes(t, t->bytes)))
			return NULL;
	}
	if (t->packed)
		t->left--;
	const unsigned char *p = t->packed && t->repeated ? t->repeated : take_bytes(t, t->bytes);
	if (!p || !t->map)
		return p;
	uint32_t i = *p - t->map_first;
	return *p >= t->map_first && i < t->map_count ? t->map + (size_t)i * t->map_bytes : NULL;
}

static int decode(const struct image_input *in, struct image *out)
{
	struct tga t = {.in = in};
	float value[256];
	int r = read_header(&t);
	if (r)
		return r;
	bool grey = t.kind == KIND_GREY, has_alpha = (t.map ? t.map_bytes : t.bytes) == 4;
	uint32_t channels = grey || in->alpha ? 1 : 3;
	uint64_t count = (uint64_t)t.width * t.height, least = (count + 127) / 128 * (1 + t.bytes);
	r = image_allocate(in, out, t.width, t.height, channels, t.packed ? least : count * t.bytes);
	if (r)
		return r;
	image_table(value, 255, in->raw || in->alpha);
	for (uint32_t j = 0; j < t.height; j++)
		for (uint32_t i = 0; i < t.width; i++) {
			uint32_t x = t.leftwards ? t.width - 1 - i : i, y = t.down ? j : t.height - 1 - j;
			float *to = out->pixels + ((size_t)y * t.width + x) * channels;
			const unsigned char *c = next_pixel(&t);
			if (!c)
				return error_set(in->error, EBADMSG,
						 "TGA: the file ends too early, or a pixel is beyond the palette");
			if (in->alpha)
				*to = has_alpha ? value[c[3]] : 1;
			else if (grey)
				*to = value[c[0]];
			else
				for (int k = 0; k < 3; k++)
					to[k] = value[c[2 - k]];
		}
	return 0;
}

const struct image_format image_format_tga = {
	.is = is_tga,
	.decode = decode,
	.alpha = IMAGE_ALPHA_READ,
};
