/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/sample_images.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>
#include <png.h>

unsigned sample_value(size_t x, size_t y, int k)
{
	return (unsigned)(x * 37 + y * 11 + (size_t)k * 85) & 255;
}

struct buffer {
	unsigned char *bytes;
	size_t size;
};

static void append_png_bytes(png_structp png, png_bytep bytes, size_t n)
{
	struct buffer *b = png_get_io_ptr(png);
	b->bytes = realloc(b->bytes, b->size + n);
	memcpy(b->bytes + b->size, bytes, n);
	b->size += n;
}

static void flush_png(png_structp png)
{
	(void)png;
}

unsigned char *sample_png(size_t width, size_t height, enum sample_pixels kind, int bits, int interlaced, size_t *size)
{
	static const int types[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA,
				    PNG_COLOR_TYPE_PALETTE};
	static const size_t channels[] = {1, 3, 4, 1};
	struct buffer b = {0};
	png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
	png_infop info = png_create_info_struct(png);
	png_set_write_fn(png, &b, append_png_bytes, flush_png);
	png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, bits, types[kind],
		     interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, 0, 0);
	png_color palette[256];
	for (size_t i = 0; i < 256; i++)
		palette[i] = (png_color){(png_byte)i, (png_byte)(255 - i), 7};
	if (kind == SAMPLE_PALETTE)
		png_set_PLTE(png, info, palette, 256);
	png_write_info(png, info);
	size_t stride = width * channels[kind] * (size_t)bits / 8;
	png_bytep pixels = malloc(stride * height);
	png_bytep *rows = malloc(height * sizeof *rows);
	for (size_t y = 0; y < height; y++) {
		rows[y] = pixels + y * stride;
		for (size_t i = 0; i < stride; i++) { /* with 16 bits both bytes are the same */
			size_t sample = i / ((size_t)bits / 8);
			rows[y][i] = (png_byte)sample_value(sample / channels[kind], y, (int)(sample % channels[kind]));
		}
	}
	png_write_image(png, rows);
	png_write_end(png, info);
	png_destroy_write_struct(&png, &info);
	free(pixels);
	free(rows);
	*size = b.size;
	return b.bytes;
}

unsigned char *sample_jpeg(size_t width, size_t height, const unsigned char *color, int components, int progressive,
			   size_t *size)
{
	struct jpeg_compress_struct j;
	struct jpeg_error_mgr errors;
	unsigned char *bytes = NULL;
	unsigned long n = 0;
	j.err = jpeg_std_error(&errors);
	jpeg_create_compress(&j);
	jpeg_mem_dest(&j, &bytes, &n);
	j.image_width = (JDIMENSION)width;
	j.image_height = (JDIMENSION)height;
	j.input_components = components;
	j.in_color_space = components == 1 ? JCS_GRAYSCALE : components == 3 ? JCS_RGB : JCS_CMYK;
	jpeg_set_defaults(&j);
	jpeg_set_quality(&j, 95, TRUE);
	if (progressive)
		jpeg_simple_progression(&j);
	jpeg_start_compress(&j, TRUE);
	size_t stride = width * (size_t)components;
	unsigned char *row = malloc(stride);
	for (size_t i = 0; i < stride; i++)
		row[i] = color[i % (size_t)components];
	while (j.next_scanline < j.image_height) {
		JSAMPROW rows[1] = {row};
		jpeg_write_scanlines(&j, rows, 1);
	}
	jpeg_finish_compress(&j);
	jpeg_destroy_compress(&j);
	free(row);
	*size = n;
	return bytes;
}
