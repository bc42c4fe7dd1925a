/* SPDX-License-Identifier: Apache-2.0 */
/* WebP files made by libwebp's encoder: equal if lossless, close if lossy; and damaged files. */
#include "common/base/mem.h"
#include "tests/support/dice.h"
#include "worker/render/image/image.h"
#include "worker/render/image/srgb.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <webp/encode.h>

#include <cmocka.h>

enum { WIDTH = 13, HEIGHT = 7 };

static uint8_t channel_level(int x, int y, int k)
{
	return (uint8_t)(k == 3 ? 255 - 30 * y : 20 * x + 9 * y + 5 * k);
}

static void fill_pixels(uint8_t *rgba)
{
	for (int i = 0; i < WIDTH * HEIGHT; i++)
		for (int k = 0; k < 4; k++)
			rgba[4 * i + k] = channel_level(i % WIDTH, i / WIDTH, k);
}

static int decode(const void *bytes, size_t size, bool raw, enum image_channel channel, struct arena *a,
		  struct image *out, struct error *e)
{
	return image_decode(bytes, size, "i", raw, channel, a, out, e);
}

static void test_lossless_images_are_exact(void **state)
{
	(void)state;
	uint8_t rgba[4 * WIDTH * HEIGHT], *file = NULL;
	fill_pixels(rgba);
	for (int i = 0; i < WIDTH * HEIGHT; i++) /* the encoder clears the colours of transparent pixels */
		rgba[4 * i + 3] = (uint8_t)(rgba[4 * i + 3] | 1);
	size_t size = WebPEncodeLosslessRGBA(rgba, WIDTH, HEIGHT, 4 * WIDTH, &file);
	assert_true(size > 0);
	for (int raw = 0; raw < 2; raw++)
		for (int part = 0; part < 3; part++) {
			static const enum image_channel channels[] = {IMAGE_ALL, IMAGE_GREEN, IMAGE_ALPHA};
			struct arena a = {0};
			struct image img;
			struct error e;
			if (decode(file, size, raw, channels[part], &a, &img, &e))
				fail_msg("%s", e.text);
			assert_true(img.width == WIDTH && img.height == HEIGHT && img.channels == (part ? 1 : 3));
			for (int i = 0; i < WIDTH * HEIGHT; i++)
				for (uint32_t k = 0; k < img.channels; k++) {
					int channel = part == 0 ? (int)k : part == 1 ? 1 : 3;
					double x = rgba[4 * i + channel] / 255.0,
					       want = raw || part == 2 ? x : srgb_to_linear(x);
					assert_true(fabs((double)img.pixels[(uint32_t)i * img.channels + k] - want) <
						    1e-6);
				}
			arena_fini(&a);
		}
	WebPFree(file);
}

static void test_lossy_images_are_close(void **state)
{
	(void)state;
	uint8_t rgb[3 * 64 * 64], *file = NULL;
	for (int i = 0; i < 64 * 64; i++)
		for (int k = 0; k < 3; k++)
			rgb[3 * i + k] = (uint8_t)(2 * (i % 64) + i / 64 + 20 * k);
	size_t size = WebPEncodeRGB(rgb, 64, 64, 3 * 64, 95, &file);
	struct arena a = {0};
	struct image img;
	struct error e;
	assert_true(size > 0 && decode(file, size, true, IMAGE_ALL, &a, &img, &e) == 0);
	for (int i = 0; i < 3 * 64 * 64; i++)
		assert_true(fabs((double)img.pixels[i] - rgb[i] / 255.0) < 12 / 255.0);
	arena_fini(&a);
	a = (struct arena){0};
	assert_true(decode(file, size, true, IMAGE_ALPHA, &a, &img, &e) == 0 && img.pixels[7] == 1);
	arena_fini(&a);
	WebPFree(file);
}

static void expect_refused(const void *bytes, size_t size, const char *text)
{
	struct arena a = {0};
	struct image img;
	struct error e = {"no error at all"};
	if (decode(bytes, size, false, IMAGE_ALL, &a, &img, &e) >= 0 || !strstr(e.text, text))
		fail_msg("%s; not: %s", e.text, text);
	arena_fini(&a);
}

/* Prefixes and single changed bytes give an image of the same size or an error message. */
static void test_damaged_files_are_decoded_or_refused(void **state)
{
	(void)state;
	uint8_t rgba[4 * WIDTH * HEIGHT], *file = NULL;
	struct dice d = dice_for_test("damaged WebP");
	fill_pixels(rgba);
	size_t size = WebPEncodeRGBA(rgba, WIDTH, HEIGHT, 4 * WIDTH, 50, &file);
	uint8_t *copy = mem_alloc(size, 1);
	expect_refused("RIFF\4\0\0\0WAVE", 12, "a RIFF file that is not a WebP image");
	expect_refused("RIFF", 4, "a RIFF file that is not a WebP image");
	for (size_t n = 12; n < size; n += 1 + n / 9)
		expect_refused(file, n, "WebP: damaged");
	for (int i = 0; i < 400; i++) {
		struct arena a = {0};
		struct image img;
		struct error e = {""};
		memcpy(copy, file, size);
		copy[12 + dice_below(&d, (uint32_t)size - 12)] = (uint8_t)dice_below(&d, 256);
		int r = decode(copy, size, false, IMAGE_ALL, &a, &img, &e);
		assert_true(r == 0 ? img.pixels != NULL : *e.text != 0);
		arena_fini(&a);
	}
	/* An extended header that promises an animation, and one that promises 2^24 x 2^24 pixels. */
	static const uint8_t moving[] = "RIFF\x1a\0\0\0WEBPVP8X\x0a\0\0\0\x02\0\0\0\x0c\0\0\x06\0\0ANIM",
			     large[] = "RIFF\x1a\0\0\0WEBPVP8X\x0a\0\0\0\0\0\0\0\xff\xff\xff\xff\xff\xff"
				       "VP8 ";
	expect_refused(moving, 34, "an animation");
	expect_refused(large, 34, "WebP: damaged");
	mem_free(copy);
	WebPFree(file);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_lossless_images_are_exact),
		cmocka_unit_test(test_lossy_images_are_close),
		cmocka_unit_test(test_damaged_files_are_decoded_or_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
