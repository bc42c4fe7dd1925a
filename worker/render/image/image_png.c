/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/image/image_decode.h"

#include "common/base/mem.h"

#include <png.h>

#include <setjmp.h>
#include <string.h>

/* State that survives libpng's longjmp. */
struct state {
	const struct image_input *in;
	struct image *out;
	png_structp png;
	png_infop info;
	size_t offset; /* bytes consumed */
	png_bytep pixels;
	png_bytep *rows;
	uint32_t channels, depth;
	int error_code;
};

static png_voidp png_allocate(png_structp png, png_alloc_size_t size)
{
	(void)png;
	return mem_alloc(1, size);
}

static void png_release(png_structp png, png_voidp p)
{
	(void)png;
	mem_free(p);
}

static void on_error(png_structp png, png_const_charp text)
{
	struct state *s = png_get_error_ptr(png);
	s->error_code = error_set(s->in->error, EBADMSG, "PNG: %s", text);
	png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp text)
{
	(void)png, (void)text;
}

static void on_read(png_structp png, png_bytep out, size_t n)
{
	struct state *s = png_get_io_ptr(png);
	if (n > s->in->size - s->offset)
		png_error(png, "the file ends too early");
	memcpy(out, s->in->bytes + s->offset, n);
	s->offset += n;
}

/* Sets libpng up to deliver grey or RGB of 8 or 16 bits, with alpha if requested: palettes and lower depths are
 * expanded. */
static int read_header(struct state *s)
{
	png_set_read_fn(s->png, s, on_read);
	png_set_user_limits(s->png, IMAGE_PIXELS_MAX, IMAGE_PIXELS_MAX);
	png_set_chunk_malloc_max(s->png, 8 << 20);
	png_set_chunk_cache_max(s->png, 64);
	png_read_info(s->png, s->info);
	uint32_t width = png_get_image_width(s->png, s->info), height = png_get_image_height(s->png, s->info);
	png_set_expand(s->png);
	if (s->in->needs_only_alpha)
		png_set_add_alpha(s->png, 0xffff, PNG_FILLER_AFTER); /* where the file has no alpha */
	else
		png_set_strip_alpha(s->png);
	png_set_interlace_handling(s->png);
	png_read_update_info(s->png, s->info);
	s->channels = png_get_channels(s->png, s->info);
	s->depth = png_get_bit_depth(s->png, s->info);
	if ((s->in->needs_only_alpha ? s->channels != 2 && s->channels != 4 : s->channels != 1 && s->channels != 3) ||
	    (s->depth != 8 && s->depth != 16))
		return error_set(s->in->error, EINVAL, "PNG with %u channels of %u bits", s->channels, s->depth);
	/* deflate expands a byte to at most 1032; a pixel takes at least one bit. */
	return image_allocate(s->in, s->out, width, height, s->in->needs_only_alpha ? 1 : s->channels,
			      (uint64_t)width * height / (8 * 1032));
}

static int read_pixels(struct state *s)
{
	size_t stride = png_get_rowbytes(s->png, s->info), height = s->out->height;
	s->pixels = mem_alloc(height, stride);
	s->rows = mem_alloc(height, sizeof *s->rows);
	if (!s->pixels || !s->rows)
		return error_set(s->in->error, ENOMEM, "out of memory");
	for (size_t y = 0; y < height; y++)
		s->rows[y] = s->pixels + y * stride;
	png_read_image(s->png, s->rows);
	png_read_end(s->png, NULL);
	return 0;
}

static void read_guarded(struct state *s)
{
	if (setjmp(png_jmpbuf(s->png)))
		return;
	s->error_code = read_header(s);
	if (!s->error_code)
		s->error_code = read_pixels(s);
}

static int convert(struct state *s)
{
	uint32_t max = s->depth == 8 ? 255 : 65535;
	float *value = mem_alloc((size_t)max + 1, sizeof *value);
	if (!value)
		return error_set(s->in->error, ENOMEM, "out of memory");
	image_fill_sample_table(value, max, s->in->is_raw || s->in->needs_only_alpha);
	uint32_t step = s->in->needs_only_alpha ? s->channels : 1,
		 first = step - 1; /* alpha is the last sample of a pixel */
	size_t n = (size_t)s->out->width * s->out->channels;
	for (uint32_t y = 0; y < s->out->height; y++) {
		const png_byte *p = s->rows[y];
		float *out = s->out->pixels + n * y;
		for (size_t i = 0; i < n; i++) {
			size_t k = i * step + first;
			out[i] = s->depth == 8 ? value[p[k]] : value[p[2 * k] << 8 | p[2 * k + 1]];
		}
	}
	mem_free(value);
	return 0;
}

static int decode(const struct image_input *in, struct image *out)
{
	struct state s = {.in = in, .out = out};
	s.png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, &s, on_error, on_warning, NULL, png_allocate,
					 png_release);
	s.info = s.png ? png_create_info_struct(s.png) : NULL;
	if (s.info)
		read_guarded(&s);
	else
		s.error_code = error_set(in->error, ENOMEM, "out of memory");
	if (!s.error_code)
		s.error_code = convert(&s);
	png_destroy_read_struct(&s.png, &s.info, NULL);
	mem_free(s.pixels);
	mem_free(s.rows);
	return s.error_code;
}

const struct image_format image_format_png = {
	.signatures = {"\x89PNG\r\n\x1a\n"},
	.decode = decode,
	.alpha_support = IMAGE_ALPHA_READ,
};
