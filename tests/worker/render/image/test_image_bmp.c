/* SPDX-License-Identifier: Apache-2.0 */
/* Windows bitmaps written by hand from the format's description: all pixel sizes, both row orders, and false headers.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/image_read.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 5, HEIGHT = 3, FILE_MAX = 2048 };

struct bitmap {
	unsigned char bytes[FILE_MAX];
	size_t size;
};

static void store_little_endian(unsigned char *p, uint32_t x, int bytes)
{
	for (int i = 0; i < bytes; i++)
		p[i] = (unsigned char)(x >> 8 * i);
}

/* Returns the index into `colours` of pixel (x,y), with y from the top. */
static uint32_t colour_index(uint32_t x, uint32_t y, uint32_t colours)
{
	return (3 * x + 7 * y + x * y) % colours;
}

static void indexed_colour(uint32_t i, bool grey, unsigned char bgr[3])
{
	for (uint32_t k = 0; k < 3; k++)
		bgr[k] = (unsigned char)(37 * i + (grey ? 5 : 61 * k));
}

/* Without a palette (24, 32 bits), the pixels contain the colours. */
static struct bitmap make_bitmap(uint32_t bits, bool is_grey, bool is_top_down, bool has_core_header, bool has_masks)
{
	struct bitmap b = {.size = 0};
	uint32_t header = has_core_header ? 12 : 40, entry = has_core_header ? 3 : 4,
		 colours = bits <= 8 ? 1u << bits : 0;
	uint32_t at = 14 + header + (has_masks ? 12 : colours * entry), stride = (WIDTH * bits + 31) / 32 * 4;
	unsigned char *p = b.bytes;
	b.size = at + stride * HEIGHT;
	assert_true(b.size <= FILE_MAX);
	memcpy(p, "BM", 2);
	store_little_endian(p + 2, (uint32_t)b.size, 4);
	store_little_endian(p + 10, at, 4);
	store_little_endian(p + 14, header, 4);
	store_little_endian(p + 18, WIDTH, has_core_header ? 2 : 4);
	store_little_endian(p + (has_core_header ? 20 : 22), (uint32_t)(is_top_down ? -HEIGHT : HEIGHT),
			    has_core_header ? 2 : 4);
	store_little_endian(p + (has_core_header ? 22 : 26), 1, 2);
	store_little_endian(p + (has_core_header ? 24 : 28), bits, 2);
	if (has_masks) {
		store_little_endian(p + 30, 3, 4);
		store_little_endian(p + 54, 0xff0000, 4);
		store_little_endian(p + 58, 0xff00, 4);
		store_little_endian(p + 62, 0xff, 4);
	}
	for (uint32_t i = 0; i < colours; i++)
		indexed_colour(i, is_grey, p + 14 + header + i * entry);
	for (uint32_t y = 0; y < HEIGHT; y++)
		for (uint32_t x = 0; x < WIDTH; x++) {
			unsigned char *row = p + at + (is_top_down ? y : HEIGHT - 1 - y) * stride;
			uint32_t i = colour_index(x, y, colours ? colours : 6);
			if (colours)
				row[x * bits / 8] |= (unsigned char)(i << (8 - bits - x * bits % 8));
			else
				indexed_colour(i, is_grey, row + x * bits / 8);
		}
	return b;
}

static int decode(const void *bytes, size_t size, struct arena *arena, struct image *out, struct error *e)
{
	const struct memory_file files[] = {{"i", bytes, size}, {0}};
	struct asset_source assets = memory_assets(files);
	return image_read(&assets, "i", true, arena, out, e);
}

static void expect_refused(const void *bytes, size_t size, const char *text)
{
	struct arena arena = {0};
	struct image img;
	struct error e = {""};
	int r = decode(bytes, size, &arena, &img, &e);
	if (r >= 0 || !strstr(e.text, text))
		fail_msg("%zu bytes gave %d: %s\n not: %s", size, r, e.text, text);
	assert_null(img.pixels);
	arena_fini(&arena);
}

static void check_pixels(const struct bitmap *b, uint32_t colours, bool grey, uint32_t channels)
{
	struct arena arena = {0};
	struct image img;
	struct error e = {""};
	if (decode(b->bytes, b->size, &arena, &img, &e))
		fail_msg("%s", e.text);
	assert_true(img.width == WIDTH && img.height == HEIGHT && img.channels == channels);
	for (uint32_t y = 0; y < HEIGHT; y++)
		for (uint32_t x = 0; x < WIDTH; x++)
			for (uint32_t k = 0; k < channels; k++) {
				unsigned char bgr[3];
				indexed_colour(colour_index(x, y, colours), grey, bgr);
				assert_true(img.pixels[(y * WIDTH + x) * channels + k] ==
					    (float)((double)bgr[2 - k] / 255));
			}
	arena_fini(&arena);
	for (size_t n = 2; n < b->size; n++)
		expect_refused(b->bytes, n, "i: ");
}

static void test_every_kind_is_decoded(void **state)
{
	(void)state;
	static const uint32_t bits[] = {1, 4, 8, 24, 32};
	for (int i = 0; i < 5; i++)
		for (int kind = 0; kind < 8; kind++) {
			bool grey = kind & 1, core = kind & 2 && bits[i] != 32, down = kind & 4 && !core;
			struct bitmap b = make_bitmap(bits[i], grey, down, core, false);
			check_pixels(&b, bits[i] <= 8 ? 1u << bits[i] : 6, grey, grey && bits[i] <= 8 ? 1 : 3);
		}
	struct bitmap b = make_bitmap(32, false, false, false, true);
	check_pixels(&b, 6, false, 3);
}

static void expect_change_refused(uint32_t bits, size_t at, uint32_t value, int bytes, const char *text)
{
	struct bitmap b = make_bitmap(bits, false, false, false, false);
	store_little_endian(b.bytes + at, value, bytes);
	expect_refused(b.bytes, b.size, text);
}

static void test_inconsistent_headers_are_refused(void **state)
{
	(void)state;
	expect_change_refused(24, 14, 13, 4, "a header of an unknown size");
	expect_change_refused(24, 14, 0xffffffff, 4, "a header of an unknown size");
	expect_change_refused(24, 18, 0, 4, "pixels; at most");
	expect_change_refused(24, 18, 0xffffffff, 4, "pixels; at most");
	expect_change_refused(24, 22, 0x80000000, 4, "pixels; at most");
	expect_change_refused(24, 18, 4000, 4, "too short for");
	expect_change_refused(24, 10, 0xffffffff, 4, "ends too early");
	expect_change_refused(24, 28, 16, 2, "16 bits per pixel");
	expect_change_refused(8, 30, 1, 4, "compressed");
	expect_change_refused(32, 30, 3, 4, "unusual masks");
	expect_change_refused(8, 46, 257, 4, "overlaps the pixels");
	expect_change_refused(8, 10, 14 + 40 + 255 * 4, 4, "overlaps the pixels");
	expect_change_refused(8, 46, 2, 4, "beyond the palette");
	struct bitmap b = make_bitmap(8, false, false, false, false);
	expect_refused(b.bytes, 14 + 40 + 4 * 256 - 1, "overlaps the pixels");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_every_kind_is_decoded),
		cmocka_unit_test(test_inconsistent_headers_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
