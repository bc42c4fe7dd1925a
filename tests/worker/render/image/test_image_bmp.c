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

static void put(unsigned char *p, uint32_t x, int bytes)
{
	for (int i = 0; i < bytes; i++)
		p[i] = (unsigned char)(x >> 8 * i);
}

/* Returns the index into `colours` of pixel (x,y), with y from the top. */
static uint32_t index_at(uint32_t x, uint32_t y, uint32_t colours)
{
	return (3 * x + 7 * y + x * y) % colours;
}

static void colour_of(uint32_t i, bool grey, unsigned char bgr[3])
{
	for (uint32_t k = 0; k < 3; k++)
		bgr[k] = (unsigned char)(37 * i + (grey ? 5 : 61 * k));
}

/* Without a palette (24, 32 bits), the pixels contain the colours. */
static struct bitmap bitmap_of(uint32_t bits, bool grey, bool down, bool core, bool masks)
{
	struct bitmap b = {.size = 0};
	uint32_t header = core ? 12 : 40, entry = core ? 3 : 4, colours = bits <= 8 ? 1u << bits : 0;
	uint32_t at = 14 + header + (masks ? 12 : colours * entry), stride = (WIDTH * bits + 31) / 32 * 4;
	unsigned char *p = b.bytes;
	b.size = at + stride * HEIGHT;
	assert_true(b.size <= FILE_MAX);
	memcpy(p, "BM", 2);
	put(p + 2, (uint32_t)b.size, 4);
	put(p + 10, at, 4);
	put(p + 14, header, 4);
	put(p + 18, WIDTH, core ? 2 : 4);
	put(p + (core ? 20 : 22), (uint32_t)(down ? -HEIGHT : HEIGHT), core ? 2 : 4);
	put(p + (core ? 22 : 26), 1, 2);
	put(p + (core ? 24 : 28), bits, 2);
	if (masks) {
		put(p + 30, 3, 4);
		put(p + 54, 0xff0000, 4);
		put(p + 58, 0xff00, 4);
		put(p + 62, 0xff, 4);
	}
	for (uint32_t i = 0; i < colours; i++)
		colour_of(i, grey, p + 14 + header + i * entry);
	for (uint32_t y = 0; y < HEIGHT; y++)
		for (uint32_t x = 0; x < WIDTH; x++) {
			unsigned char *row = p + at + (down ? y : HEIGHT - 1 - y) * stride;
			uint32_t i = index_at(x, y, colours ? colours : 6);
			if (colours)
				row[x * bits / 8] |= (unsigned char)(i << (8 - bits - x * bits % 8));
			else
				colour_of(i, grey, row + x * bits / 8);
		}
	return b;
}

static int decode(const void *bytes, size_t size, struct arena *arena, struct image *out, struct error *e)
{
	const struct memory_file files[] = {{"i", bytes, size}, {0}};
	struct asset_source assets = memory_assets(files);
	return image_read(&assets, "i", true, arena, out, e);
}

static void refuses(const void *bytes, size_t size, const char *text)
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

static void check(const struct bitmap *b, uint32_t colours, bool grey, uint32_t channels)
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
				colour_of(index_at(x, y, colours), grey, bgr);
				assert_true(img.pixels[(y * WIDTH + x) * channels + k] ==
					    (float)((double)bgr[2 - k] / 255));
			}
	arena_fini(&arena);
	for (size_t n = 2; n < b->size; n++)
		refuses(b->bytes, n, "i: ");
}

static void test_all_kinds(void **state)
{
	(void)state;
	static const uint32_t bits[] = {1, 4, 8, 24, 32};
	for (int i = 0; i < 5; i++)
		for (int kind = 0; kind < 8; kind++) {
			bool grey = kind & 1, core = kind & 2 && bits[i] != 32, down = kind & 4 && !core;
			struct bitmap b = bitmap_of(bits[i], grey, down, core, false);
			check(&b, bits[i] <= 8 ? 1u << bits[i] : 6, grey, grey && bits[i] <= 8 ? 1 : 3);
		}
	struct bitmap b = bitmap_of(32, false, false, false, true);
	check(&b, 6, false, 3);
}

static void refuses_changed(uint32_t bits, size_t at, uint32_t value, int bytes, const char *text)
{
	struct bitmap b = bitmap_of(bits, false, false, false, false);
	put(b.bytes + at, value, bytes);
	refuses(b.bytes, b.size, text);
}

static void test_lies(void **state)
{
	(void)state;
	refuses_changed(24, 14, 13, 4, "a header of an unknown size");
	refuses_changed(24, 14, 0xffffffff, 4, "a header of an unknown size");
	refuses_changed(24, 18, 0, 4, "pixels; at most");
	refuses_changed(24, 18, 0xffffffff, 4, "pixels; at most");
	refuses_changed(24, 22, 0x80000000, 4, "pixels; at most");
	refuses_changed(24, 18, 4000, 4, "too short for");
	refuses_changed(24, 10, 0xffffffff, 4, "ends too early");
	refuses_changed(24, 28, 16, 2, "16 bits per pixel");
	refuses_changed(8, 30, 1, 4, "compressed");
	refuses_changed(32, 30, 3, 4, "unusual masks");
	refuses_changed(8, 46, 257, 4, "overlaps the pixels");
	refuses_changed(8, 10, 14 + 40 + 255 * 4, 4, "overlaps the pixels");
	refuses_changed(8, 46, 2, 4, "beyond the palette");
	struct bitmap b = bitmap_of(8, false, false, false, false);
	refuses(b.bytes, 14 + 40 + 4 * 256 - 1, "overlaps the pixels");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_all_kinds),
		cmocka_unit_test(test_lies),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
