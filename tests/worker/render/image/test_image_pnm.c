/* SPDX-License-Identifier: Apache-2.0 */
/* Portable maps written by hand: integers of 8 and 16 bits, floats in both byte orders, comments, and false headers. */
#include "tests/support/memory_assets.h"
#include "worker/render/image/image.h"
#include "worker/render/image/srgb.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 3, HEIGHT = 2, FILE_MAX = 512 };

struct pnm_file {
	unsigned char bytes[FILE_MAX];
	size_t size;
};

static struct pnm_file begin_file(const char *text)
{
	struct pnm_file f = {.size = strlen(text)};
	memcpy(f.bytes, text, f.size);
	return f;
}

static void append_number(struct pnm_file *f, uint32_t value, int bytes, bool big_endian)
{
	for (int i = 0; i < bytes; i++)
		f->bytes[f->size++] = (unsigned char)(value >> 8 * (big_endian ? bytes - 1 - i : i));
}

static unsigned integer_sample(unsigned i, unsigned max)
{
	return (i * 37 + 11) % (max + 1);
}

static double real_sample(unsigned i)
{
	return i == 4 ? -0.75 : 0.125 * i * i;
}

static struct pnm_file make_integer_file(const char *header, unsigned channels, unsigned max)
{
	struct pnm_file f = begin_file(header);
	for (unsigned i = 0; i < WIDTH * HEIGHT * channels; i++)
		append_number(&f, integer_sample(i, max), max < 256 ? 1 : 2, true);
	return f;
}

/* Sample i belongs to its row from the top; rows are stored from the bottom. */
static struct pnm_file make_real_file(const char *header, unsigned channels, bool big_endian)
{
	struct pnm_file f = begin_file(header);
	for (unsigned y = HEIGHT; y-- > 0;)
		for (unsigned i = 0; i < WIDTH * channels; i++) {
			float x = (float)real_sample(y * WIDTH * channels + i);
			uint32_t bits;
			memcpy(&bits, &x, sizeof bits);
			append_number(&f, bits, 4, big_endian);
		}
	return f;
}

static int decode(const struct pnm_file *f, size_t size, bool raw, struct arena *a, struct image *img, struct error *e)
{
	return image_decode(f->bytes, size, "i", raw, IMAGE_ALL, a, img, e);
}

static void expect_refused(const struct pnm_file *f, size_t size, const char *text)
{
	struct arena a = {0};
	struct image img;
	struct error e = {""};
	int r = decode(f, size, false, &a, &img, &e);
	if (r >= 0 || !strstr(e.text, text))
		fail_msg("%zu bytes of \"%.20s\" gave %d: %s\n not: %s", size, (const char *)f->bytes, r, e.text, text);
	assert_null(img.pixels);
	arena_fini(&a);
}

static void expect_text_refused(const char *text, const char *why)
{
	struct pnm_file f = begin_file(text);
	expect_refused(&f, f.size, why);
}

/* max 0: floats, multiplied by `scale`. */
static void check_pixels(const struct pnm_file *f, unsigned channels, unsigned max, double scale)
{
	for (int raw = 0; raw < 2; raw++) {
		struct arena a = {0};
		struct image img;
		struct error e = {""};
		if (decode(f, f->size, raw, &a, &img, &e))
			fail_msg("%s", e.text);
		assert_true(img.width == WIDTH && img.height == HEIGHT && img.channels == channels);
		for (unsigned i = 0; i < WIDTH * HEIGHT * channels; i++) {
			double due = max ? (double)integer_sample(i, max) / max : real_sample(i) * scale;
			due = max && !raw ? srgb_to_linear(due) : due;
			if (!(fabs((double)img.pixels[i] - due) < 1e-6))
				fail_msg("sample %u: %g, not %g", i, (double)img.pixels[i], due);
		}
		arena_fini(&a);
	}
	for (size_t n = 2; n < f->size; n++)
		expect_refused(f, n, "i: ");
}

static void test_integer_formats_are_decoded(void **state)
{
	(void)state;
	struct pnm_file f = make_integer_file("P5 3 2 255\n", 1, 255);
	check_pixels(&f, 1, 255, 0);
	f = make_integer_file("P6\n# by hand\n3 # wide\n\t2\r\n255\n", 3, 255);
	check_pixels(&f, 3, 255, 0);
	f = make_integer_file("P6\n3\n2\n100\n", 3, 100);
	check_pixels(&f, 3, 100, 0);
	f = make_integer_file("P5 3 2 65535 ", 1, 65535);
	check_pixels(&f, 1, 65535, 0);
	f = make_integer_file("P6 3 2 256\n", 3, 256);
	check_pixels(&f, 3, 256, 0);
}

static void test_float_formats_are_decoded(void **state)
{
	(void)state;
	struct pnm_file f = make_real_file("PF\n3 2\n-1.0\n", 3, false);
	check_pixels(&f, 3, 0, 1);
	f = make_real_file("PF\n3 2\n1.0\n", 3, true);
	check_pixels(&f, 3, 0, 1);
	f = make_real_file("Pf\n3 2\n-2.5\n", 1, false);
	check_pixels(&f, 1, 0, 2.5);
}

static void test_inconsistent_headers_are_refused(void **state)
{
	(void)state;
	expect_text_refused("P5 x 2 255\n", "needs a width, a height and a scale");
	expect_text_refused("P5 3 -2 255\n", "needs a width, a height and a scale");
	expect_text_refused("P5 3 2 255", "needs a width, a height and a scale");
	expect_text_refused("P5 3 2 # 255\n", "needs a width, a height and a scale");
	expect_text_refused("P5 0000000000000000000000000000000003 2 255\n", "needs a width, a height and a scale");
	expect_text_refused("P5 3 2 65536\n", "the largest sample must be within [1, 65535]");
	expect_text_refused("P6 3 2 0\n", "the largest sample must be within [1, 65535]");
	expect_text_refused("P6 3 2 1.5\n", "the largest sample must be within [1, 65535]");
	expect_text_refused("PF 3 2 0\n", "a scale of 0");
	expect_text_refused("P6 300000 300000 255\n", "pixels; at most");
	expect_text_refused("P6 92233720368547 2 255\n", "pixels; at most");
	expect_text_refused("P6 300 300 255\n", "too short for");
	struct pnm_file f = make_integer_file("P5 3 2 200\n", 1, 200);
	f.bytes[f.size - 1] = 201;
	expect_refused(&f, f.size, "a sample above the stated maximum");
	f = make_real_file("Pf\n3 2\n-1\n", 1, false);
	memcpy(f.bytes + f.size - 4, "\0\0\xc0\x7f", 4);
	expect_refused(&f, f.size, "a pixel that is not finite");
	f = make_real_file("Pf\n3 2\n-1e39\n", 1, false);
	expect_refused(&f, f.size, "a pixel that is not finite");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_integer_formats_are_decoded),
		cmocka_unit_test(test_float_formats_are_decoded),
		cmocka_unit_test(test_inconsistent_headers_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
