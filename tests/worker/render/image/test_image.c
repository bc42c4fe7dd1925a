/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Readers of PNG, JPEG, HDR and EXR: all types and depths of pixels are read with the values that were written, with
 * and without the sRGB curve; truncated and damaged files are refused; files that promise more pixels than a scene
 * may have are refused before anything is allocated; each failing allocation gives an error and leaks nothing.
 */
#include "tests/support/failing_memory.h"
#include "tests/support/image_read.h"

#include "common/base/mem.h"
#include "common/exr/exr_image.h"
#include "tests/support/memory_assets.h"
#include "tests/support/sample_images.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static int decode(const void *bytes, size_t size, bool raw, struct arena *arena, struct image *out, struct error *e)
{
	const struct memory_file files[] = {{"i", bytes, size}, {0}};
	struct asset_source assets = memory_assets(files);
	return image_read(&assets, "i", raw, arena, out, e);
}

static struct image decode_ok(const void *bytes, size_t size, bool raw, struct arena *arena)
{
	struct image img;
	struct error e;
	if (decode(bytes, size, raw, arena, &img, &e))
		fail_msg("%s", e.text);
	return img;
}

static void expect_refused(const void *bytes, size_t size, const char *text)
{
	struct arena arena = {0};
	struct image img;
	struct error e = {""};
	int r = decode(bytes, size, false, &arena, &img, &e);
	if (r >= 0 || !strstr(e.text, text))
		fail_msg("gave %d: %s\n not: %s", r, e.text, text);
	assert_null(img.pixels);
	arena_fini(&arena);
}

static double expected_linear(double x)
{
	return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
}

static void check_png(enum sample_pixels kind, int bits, int interlaced, bool raw)
{
	size_t size;
	unsigned char *png = sample_png(13, 9, kind, bits, interlaced, &size);
	struct arena arena = {0};
	struct image img = decode_ok(png, size, raw, &arena);
	uint32_t channels = kind == SAMPLE_GREY ? 1 : 3;
	assert_true(img.width == 13 && img.height == 9 && img.channels == channels);
	for (size_t y = 0; y < 9; y++)
		for (size_t x = 0; x < 13; x++)
			for (uint32_t k = 0; k < channels; k++) {
				unsigned v = sample_value(x, y, kind == SAMPLE_PALETTE ? 0 : (int)k);
				if (kind == SAMPLE_PALETTE)
					v = k == 0 ? v : k == 1 ? 255 - v : 7;
				double want = raw ? v / 255.0 : expected_linear(v / 255.0);
				if (!(fabs(img.pixels[(y * 13 + x) * channels + k] - want) < 1e-6))
					fail_msg("kind %d, %d bits, (%zu, %zu)", kind, bits, x, y);
			}
	arena_fini(&arena);
	free(png);
}

static void test_png_of_every_kind_is_decoded(void **state)
{
	(void)state;
	for (int raw = 0; raw < 2; raw++)
		for (int interlaced = 0; interlaced < 2; interlaced++) {
			check_png(SAMPLE_GREY, 8, interlaced, raw);
			check_png(SAMPLE_GREY, 16, interlaced, raw);
			check_png(SAMPLE_RGB, 8, interlaced, raw);
			check_png(SAMPLE_RGB, 16, interlaced, raw);
			check_png(SAMPLE_RGBA, 8, interlaced, raw);
			check_png(SAMPLE_PALETTE, 8, interlaced, raw);
		}
}

/* One channel of each pixel, and alpha, which is 1 in images without alpha and never decoded as a colour. */
static void test_single_channels_are_selected(void **state)
{
	(void)state;
	static const struct {
		enum sample_pixels kind;
		int bits;
	} kinds[] = {{SAMPLE_RGBA, 8}, {SAMPLE_RGBA, 16}, {SAMPLE_RGB, 8}, {SAMPLE_GREY, 16}, {SAMPLE_PALETTE, 8}};
	for (size_t n = 0; n < sizeof kinds / sizeof *kinds; n++)
		for (int channel = IMAGE_RED; channel <= IMAGE_ALPHA; channel++) {
			size_t size;
			unsigned char *png = sample_png(13, 9, kinds[n].kind, kinds[n].bits, 0, &size);
			struct arena arena = {0};
			struct image img;
			struct error e;
			if (image_decode(png, size, "i", false, (enum image_channel)channel, &arena, &img, &e))
				fail_msg("%s", e.text);
			assert_true(img.width == 13 && img.height == 9 && img.channels == 1);
			for (size_t i = 0; i < 13 * 9; i++) {
				int k = kinds[n].kind == SAMPLE_GREY ? 0 : channel - IMAGE_RED;
				double v = sample_value(i % 13, i / 13, kinds[n].kind == SAMPLE_PALETTE ? 0 : k);
				if (kinds[n].kind == SAMPLE_PALETTE)
					v = k == 0 ? v : k == 1 ? 255 - v : 7;
				double want = channel != IMAGE_ALPHA	     ? expected_linear(v / 255)
					      : kinds[n].kind == SAMPLE_RGBA ? v / 255
									     : 1;
				if (!(fabs((double)img.pixels[i] - want) < 1e-6))
					fail_msg("kind %zu, channel %d, pixel %zu: %g, not %g", n, channel, i,
						 (double)img.pixels[i], want);
			}
			arena_fini(&arena);
			free(png);
		}
	size_t size;
	unsigned char *jpeg = sample_jpeg(8, 8, (const unsigned char[]){200, 100, 50}, 3, 0, &size);
	struct arena arena = {0};
	struct image img;
	struct error e;
	assert_int_equal(image_decode(jpeg, size, "i", false, IMAGE_ALPHA, &arena, &img, &e), 0);
	assert_true(img.width == 8 && img.height == 8 && img.channels == 1);
	for (size_t i = 0; i < 64; i++)
		assert_true(img.pixels[i] == 1);
	free(jpeg);
	static const unsigned char exr[] = {0x76, 0x2f, 0x31, 0x01};
	assert_int_equal(image_decode(exr, sizeof exr, "i", false, IMAGE_ALPHA, &arena, &img, &e), -ENOTSUP);
	assert_string_equal(e.text, "i: alpha is only read from PNG, WebP and TGA");
	arena_fini(&arena);
}

static void test_invalid_png_is_refused(void **state)
{
	(void)state;
	size_t size;
	unsigned char *png = sample_png(13, 9, SAMPLE_RGB, 8, 0, &size);
	for (size_t n = 0; n < size; n++)
		expect_refused(png, n, n < 8 ? "unknown image format" : "i: PNG: ");
	unsigned char *copy = malloc(size);
	for (size_t at = 8; at < size; at++) { /* every chunk has a checksum */
		memcpy(copy, png, size);
		copy[at] ^= 0x40;
		struct arena arena = {0};
		struct image img;
		struct error e;
		int r = decode(copy, size, false, &arena, &img, &e);
		assert_true(r < 0 || img.pixels);
		arena_fini(&arena);
	}
	free(copy);
	free(png);
}

/* Returns a PNG of one pixel whose header claims side x side pixels. */
static unsigned char *make_oversized_png(unsigned side, int color, size_t *size)
{
	unsigned char *small = sample_png(1, 1, SAMPLE_RGB, 8, 0, size), high = (unsigned char)(side >> 8),
		      low = (unsigned char)side;
	const unsigned char ihdr[] = {
		0, 0, 0, 13, 'I', 'H', 'D', 'R', 0, 0, high, low, 0, 0, high, low, 8, (unsigned char)color, 0, 0, 0};
	memcpy(small + 8, ihdr, sizeof ihdr);
	uint32_t crc = 0xffffffff;
	for (size_t i = 12; i < 29; i++) {
		crc ^= small[i];
		for (int k = 0; k < 8; k++)
			crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
	}
	crc = ~crc;
	for (int i = 0; i < 4; i++)
		small[29 + i] = (unsigned char)(crc >> (24 - 8 * i));
	return small;
}

static void expect_png_refused(unsigned side, int color, const char *text)
{
	size_t size;
	unsigned char *png = make_oversized_png(side, color, &size);
	expect_refused(png, size, text);
	free(png);
}

/* A header that promises pixels without data for them is refused before memory is allocated, and so is one with more
 * pixels than a scene may have. */
static void test_oversized_png_is_refused(void **state)
{
	(void)state;
	expect_png_refused(8192, 2, "i: too short for 8192 x 8192 pixels");
	expect_png_refused(16000, 2, "i: 16000 x 16000 pixels; at most 134217728");
}

/* The size in a frame's header; a file of this size may be well compressed. */
static void test_oversized_jpeg_is_refused(void **state)
{
	(void)state;
	static const unsigned char orange[] = {220, 130, 40};
	size_t size, at = 2;
	unsigned char *jpeg = sample_jpeg(8, 8, orange, 3, 0, &size);
	while (jpeg[at + 1] != 0xc0)
		at += 2 + ((size_t)jpeg[at + 2] << 8 | jpeg[at + 3]);
	memcpy(jpeg + at + 5, "\x2e\xe0\x2e\xe0", 4);
	expect_refused(jpeg, size, "i: 12000 x 12000 pixels; at most 134217728");
	memcpy(jpeg + at + 5, "\x75\x30\x75\x30", 4);
	expect_refused(jpeg, size, "i: 30000 x 30000 pixels; at most");
	free(jpeg);
}

static void check_jpeg(const unsigned char *color, int components, int progressive)
{
	size_t size;
	unsigned char *jpeg = sample_jpeg(37, 21, color, components, progressive, &size);
	struct arena arena = {0};
	struct image img = decode_ok(jpeg, size, true, &arena);
	assert_true(img.width == 37 && img.height == 21 && img.channels == (uint32_t)components);
	for (uint32_t i = 0; i < 37 * 21; i++)
		for (uint32_t k = 0; k < img.channels; k++)
			assert_true(fabs(img.pixels[i * img.channels + k] - color[k] / 255.0) < 2.5 / 255);
	arena_fini(&arena);
	for (size_t n = 3; n < size - 2; n += 1 + n / 50)
		expect_refused(jpeg, n, "i: ");
	free(jpeg);
}

static void test_jpeg_of_every_kind_is_decoded(void **state)
{
	(void)state;
	static const unsigned char grey[] = {90}, orange[] = {220, 130, 40}, ink[] = {1, 2, 3, 4};
	check_jpeg(grey, 1, 0);
	check_jpeg(orange, 3, 0);
	check_jpeg(orange, 3, 1);
	size_t size;
	unsigned char *jpeg = sample_jpeg(8, 8, ink, 4, 0, &size);
	expect_refused(jpeg, size, "for printing (CMYK)");
	free(jpeg);
}

static const char hdr_header[] = "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n";

static size_t make_hdr(unsigned char *out, const char *resolution, const void *pixels, size_t n)
{
	size_t size = (size_t)sprintf((char *)out, "%s%s\n", hdr_header, resolution);
	memcpy(out + size, pixels, n);
	return size + n;
}

static void test_hdr_is_decoded(void **state)
{
	(void)state;
	unsigned char file[512];
	static const unsigned char flat[] = {128, 64, 0, 129, 255, 1, 2, 136, 9, 9, 9, 0};
	size_t size = make_hdr(file, "-Y 1 +X 3", flat, sizeof flat);
	struct arena arena = {0};
	struct image img = decode_ok(file, size, false, &arena);
	static const float want[] = {1, 0.5f, 0, 255, 1, 2, 0, 0, 0};
	assert_true(img.width == 3 && img.height == 1 && img.channels == 3);
	for (int i = 0; i < 9; i++)
		assert_true(img.pixels[i] == want[i]);
	for (size_t n = 11; n < size; n++)
		expect_refused(file, n, "i: Radiance HDR: ");
	/* Runs: red 8 x 128; green 3 x 1, then 2 3 4 5 6; blue 8 x 0; exponent 8 x 136. */
	static const unsigned char runs[] = {2, 2, 0, 8, 136, 128, 131, 1, 5, 2, 3, 4, 5, 6, 136, 0, 136, 136};
	size = make_hdr(file, "-Y 1 +X 8", runs, sizeof runs);
	img = decode_ok(file, size, false, &arena);
	for (int x = 0; x < 8; x++)
		assert_true(img.pixels[3 * x] == 128 && img.pixels[3 * x + 1] == (x < 3 ? 1 : (float)(x - 1)) &&
			    img.pixels[3 * x + 2] == 0);
	for (size_t n = 11; n < size; n++)
		expect_refused(file, n, "i: Radiance HDR: ");
	arena_fini(&arena);
}

static void test_invalid_hdr_is_refused(void **state)
{
	(void)state;
	unsigned char file[512];
	static const unsigned char pixels[64] = {2, 2, 0, 8, 255};
	expect_refused(file, make_hdr(file, "+Y 1 +X 3", pixels, 12), "only the resolution line");
	expect_refused(file, make_hdr(file, "-Y 1 +X 0", pixels, 12), "only the resolution line");
	expect_refused(file, make_hdr(file, "-Y 99999999999999999999 +X 1", pixels, 12), "only the resolution line");
	expect_refused(file, make_hdr(file, "-Y 100000 +X 100000", pixels, 12), "pixels; at most");
	expect_refused(file, make_hdr(file, "-Y 5000 +X 5000", pixels, 12), "too short for");
	expect_refused(file, make_hdr(file, "-Y 8192 +X 16384", pixels, 12), "too short for 16384 x 8192 pixels");
	expect_refused(file, make_hdr(file, "-Y 8193 +X 16384", pixels, 12), "pixels; at most 134217728");
	expect_refused(file, make_hdr(file, "-Y 9223372036854775000 +X 9223372036854775000", pixels, 12),
		       "pixels; at most");
	expect_refused(file, make_hdr(file, "-Y 1 +X 8", pixels, 64), "run lengths that do not fill");
	expect_refused(file, make_hdr(file, "-Y 1 +X 9", pixels, 64), "a scan line whose width is not");
	static const unsigned char old[] = {9, 9, 9, 9, 1, 1, 1, 3};
	expect_refused(file, make_hdr(file, "-Y 1 +X 2", old, 8), "old run-length encoding");
	static const char xyze[] = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n....";
	expect_refused(xyze, sizeof xyze - 1, "only FORMAT=32-bit_rle_rgbe");
}

enum { EXR_WIDTH = 16, EXR_HEIGHT = 8, EXR_PIXELS = EXR_WIDTH * EXR_HEIGHT };

static unsigned char *make_exr(const char *const *names, uint32_t channels, const float *value, size_t *size)
{
	struct exr_image x = {.width = EXR_WIDTH,
			      .height = EXR_HEIGHT,
			      .channel_count = channels,
			      .full_width = EXR_WIDTH,
			      .full_height = EXR_HEIGHT};
	float planes[3][EXR_PIXELS];
	for (uint32_t k = 0; k < channels; k++) {
		snprintf(x.channel_names[k], sizeof x.channel_names[k], "%s", names[k]);
		x.planes[k] = planes[k];
		for (int i = 0; i < EXR_PIXELS; i++)
			planes[k][i] = value[k] * (float)(i + 1);
	}
	unsigned char *bytes;
	struct error e;
	if (exr_write(&x, &bytes, size, &e))
		fail_msg("%s", e.text);
	return bytes;
}

static void test_exr_channels_are_decoded(void **state)
{
	(void)state;
	static const char *const rgb[] = {"R", "G", "B"}, *const y[] = {"Y"}, *const odd[] = {"R", "G", "Z"};
	static const float value[] = {1, 1000, -0.5f}, bad[] = {1, INFINITY, 1};
	struct arena arena = {0};
	size_t size;
	unsigned char *exr = make_exr(rgb, 3, value, &size);
	struct image img = decode_ok(exr, size, false, &arena);
	assert_true(img.width == EXR_WIDTH && img.height == EXR_HEIGHT && img.channels == 3);
	for (int i = 0; i < EXR_PIXELS; i++)
		for (int k = 0; k < 3; k++)
			assert_true(img.pixels[3 * i + k] == value[k] * (float)(i + 1));
	expect_refused(exr, size / 2, "i: ");
	mem_free(exr);
	exr = make_exr(rgb, 3, value, &size);
	for (size_t i = 0; i < size - 40; i++) /* xMin yMin xMax yMax follow the name, the type and a length */
		if (memcmp(exr + i, "dataWindow\0box2i", 17) == 0)
			memcpy(exr + i + 17 + 4 + 8, "\xdf\x2e\0\0\xdf\x2e\0", 8);
	expect_refused(exr, size, "i: 12000 x 12000 pixels of 3 channels take 1647 MB decoded; at most 1536 MB");
	mem_free(exr);
	exr = make_exr(y, 1, value, &size);
	img = decode_ok(exr, size, false, &arena);
	assert_true(img.channels == 1 && img.pixels[7] == 8);
	mem_free(exr);
	exr = make_exr(odd, 3, value, &size);
	expect_refused(exr, size, "OpenEXR without channel B");
	mem_free(exr);
	exr = make_exr(rgb, 3, bad, &size);
	expect_refused(exr, size, "pixel (0, 0) is not finite");
	mem_free(exr);
	arena_fini(&arena);
}

static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	static const unsigned char orange[] = {220, 130, 40}, flat[] = {128, 64, 0, 129};
	static const char *const rgb[] = {"R", "G", "B"};
	static const float value[] = {1, 2, 3};
	unsigned char hdr[512];
	struct file {
		unsigned char *bytes;
		size_t size;
	} files[4];
	files[0].bytes = sample_png(13, 9, SAMPLE_RGB, 8, 1, &files[0].size);
	files[1].bytes = sample_jpeg(8, 8, orange, 3, 0, &files[1].size);
	files[2] = (struct file){hdr, make_hdr(hdr, "-Y 1 +X 1", flat, sizeof flat)};
	files[3].bytes = make_exr(rgb, 3, value, &files[3].size);
	for (int f = 0; f < 4; f++) {
		int r = -1;
		for (long n = 0; r && n < 1000; n++) {
			struct arena arena = {0};
			struct image img;
			mem_fail_after(n);
			r = decode(files[f].bytes, files[f].size, false, &arena, &img, NULL);
			mem_fail_after(-1);
			assert_true(r || img.pixels);
			arena_fini(&arena);
		}
		assert_int_equal(r, 0);
	}
	free(files[0].bytes);
	free(files[1].bytes);
	mem_free(files[3].bytes);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_single_channels_are_selected),
		cmocka_unit_test(test_png_of_every_kind_is_decoded),
		cmocka_unit_test(test_invalid_png_is_refused),
		cmocka_unit_test(test_oversized_png_is_refused),
		cmocka_unit_test(test_jpeg_of_every_kind_is_decoded),
		cmocka_unit_test(test_hdr_is_decoded),
		cmocka_unit_test(test_invalid_hdr_is_refused),
		cmocka_unit_test(test_oversized_jpeg_is_refused),
		cmocka_unit_test(test_exr_channels_are_decoded),
		cmocka_unit_test(test_failed_allocations_are_reported),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
