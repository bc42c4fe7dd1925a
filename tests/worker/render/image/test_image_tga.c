/* SPDX-License-Identifier: Apache-2.0 */
/* TGA files written by hand from the format's description: all types, plain and compressed, from all corners, and
 * false headers. */
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

enum {
	WIDTH = 7,
	HEIGHT = 4,
	FILE_MAX = 2048,
	COLOURS = 9,
	FIRST_INDEX = 3,
	KIND_MAPPED = 1,
	KIND_COLOUR = 2,
	KIND_GREY = 3,
	KIND_PACKED = 8
};

struct tga_file {
	unsigned char bytes[FILE_MAX];
	size_t size;
};

struct tga_form {
	unsigned kind, bits;
	bool is_packed, is_top_down, is_right_to_left;
};

/* Some rows have runs, others have runs that cross their ends, and others none. */
static unsigned channel_level(unsigned x, unsigned y, unsigned k)
{
	unsigned run = y == 1 ? 0 : y == 2 ? x / 3 : x;
	return k == 3 ? 100 + 20 * y : 10 + 20 * run + 3 * k;
}

static unsigned colour_index(unsigned x, unsigned y)
{
	return (y == 1 ? 5 : 2 * x + y) % COLOURS;
}

static unsigned map_level(unsigned i, unsigned k)
{
	return 20 * i + 7 * k;
}

static void append_byte(struct tga_file *f, unsigned value)
{
	assert_true(f->size < FILE_MAX);
	f->bytes[f->size++] = (unsigned char)value;
}

static unsigned encode_pixel(const struct tga_form *o, unsigned n, unsigned char out[4])
{
	unsigned i = n % WIDTH, j = n / WIDTH, x = o->is_right_to_left ? WIDTH - 1 - i : i,
		 y = o->is_top_down ? j : HEIGHT - 1 - j;
	if (o->kind == KIND_MAPPED)
		out[0] = (unsigned char)(FIRST_INDEX + colour_index(x, y));
	for (unsigned k = 0; k < o->bits / 8 && o->kind != KIND_MAPPED; k++)
		out[k] = (unsigned char)channel_level(x, y, k == 3 || o->kind == KIND_GREY ? k : 2 - k);
	return o->kind == KIND_MAPPED ? 1 : o->bits / 8;
}

/* Writes packets of at most four pixels. */
static void append_pixels(struct tga_file *f, const struct tga_form *o)
{
	for (unsigned n = 0; n < WIDTH * HEIGHT;) {
		unsigned char first[4] = {0}, next[4] = {0};
		unsigned bytes = encode_pixel(o, n, first), run = 1;
		while (o->is_packed && run < 4 && n + run < WIDTH * HEIGHT && encode_pixel(o, n + run, next) &&
		       memcmp(first, next, bytes) == 0)
			run++;
		if (o->is_packed)
			append_byte(f, run > 1 ? 0x80 | (run - 1) : 0);
		for (unsigned k = 0; k < bytes; k++)
			append_byte(f, first[k]);
		n += run;
	}
}

static struct tga_file make_file(const struct tga_form *o)
{
	struct tga_file f = {.size = 0};
	bool mapped = o->kind == KIND_MAPPED;
	const unsigned header[18] = {3,
				     mapped,
				     o->kind | (o->is_packed ? KIND_PACKED : 0),
				     mapped ? FIRST_INDEX : 0,
				     0,
				     mapped ? COLOURS : 0,
				     0,
				     mapped ? o->bits : 0,
				     1,
				     0,
				     2,
				     0,
				     WIDTH,
				     0,
				     HEIGHT,
				     0,
				     mapped ? 8 : o->bits,
				     (o->bits == 32 ? 8u : 0) | (o->is_right_to_left ? 0x10u : 0) |
					     (o->is_top_down ? 0x20u : 0)};
	for (int i = 0; i < 18; i++)
		append_byte(&f, header[i]);
	for (int i = 0; i < 3; i++)
		append_byte(&f, 'x');
	for (unsigned i = 0; i < COLOURS && mapped; i++)
		for (unsigned k = 0; k < o->bits / 8; k++)
			append_byte(&f, map_level(i, k == 3 ? 3 : 2 - k));
	append_pixels(&f, o);
	return f;
}

static int decode(const struct tga_file *f, size_t size, const char *name, enum image_channel channel, struct arena *a,
		  struct image *img, struct error *e)
{
	return image_decode(f->bytes, size, name, false, channel, a, img, e);
}

static void expect_refused(const struct tga_file *f, size_t size, const char *text)
{
	struct arena a = {0};
	struct image img;
	struct error e = {""};
	int r = decode(f, size, "i.tga", IMAGE_ALL, &a, &img, &e);
	if (r >= 0 || !strstr(e.text, text))
		fail_msg("%zu bytes gave %d: %s\n not: %s", size, r, e.text, text);
	assert_null(img.pixels);
	arena_fini(&a);
}

static unsigned stored_level(const struct tga_form *o, unsigned x, unsigned y, unsigned k)
{
	return o->kind == KIND_MAPPED ? map_level(colour_index(x, y), k) : channel_level(x, y, k);
}

static void check_pixels(const struct tga_form *o, enum image_channel channel)
{
	struct tga_file f = make_file(o);
	struct arena a = {0};
	struct image img;
	struct error e = {""};
	bool alpha = channel == IMAGE_ALPHA;
	if (decode(&f, f.size, "Leaf.TGA", channel, &a, &img, &e))
		fail_msg("%s", e.text);
	unsigned channels = o->kind == KIND_GREY || alpha ? 1 : 3;
	assert_true(img.width == WIDTH && img.height == HEIGHT && img.channels == channels);
	for (unsigned y = 0; y < HEIGHT; y++)
		for (unsigned x = 0; x < WIDTH; x++)
			for (unsigned k = 0; k < channels; k++) {
				double due = alpha ? o->bits == 32 ? stored_level(o, x, y, 3) / 255.0 : 1
						   : srgb_to_linear(stored_level(o, x, y, k) / 255.0);
				double found = (double)img.pixels[(y * WIDTH + x) * channels + k];
				if (!(fabs(found - due) < 1e-6))
					fail_msg("kind %u, %u bits, (%u, %u, %u): %g, not %g", o->kind, o->bits, x, y,
						 k, found, due);
			}
	arena_fini(&a);
	for (size_t n = 0; n < f.size; n++)
		expect_refused(&f, n, "i.tga: ");
}

static void test_every_kind_is_decoded(void **state)
{
	(void)state;
	static const unsigned kinds[][2] = {
		{KIND_MAPPED, 24}, {KIND_MAPPED, 32}, {KIND_COLOUR, 24}, {KIND_COLOUR, 32}, {KIND_GREY, 8}};
	for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
		for (int way = 0; way < 8; way++) {
			const struct tga_form o = {kinds[i][0], kinds[i][1], way & 1, way & 2, way & 4};
			check_pixels(&o, IMAGE_ALL);
			check_pixels(&o, IMAGE_ALPHA);
		}
}

/* Without a file name, the signature of version 2 identifies the format. */
static void test_signature_identifies_unnamed_files(void **state)
{
	(void)state;
	const struct tga_form o = {KIND_COLOUR, 24, false, true, false};
	struct tga_file f = make_file(&o);
	struct arena a = {0};
	struct image img;
	struct error e;
	assert_int_equal(decode(&f, f.size, "i", IMAGE_ALL, &a, &img, &e), -EINVAL);
	assert_non_null(strstr(e.text, "unknown image format"));
	f.size += 8;
	memcpy(f.bytes + f.size, "TRUEVISION-XFILE.", 18);
	f.size += 18;
	assert_int_equal(decode(&f, f.size, "i", IMAGE_ALL, &a, &img, &e), 0);
	arena_fini(&a);
}

static void expect_change_refused(unsigned kind, unsigned bits, size_t at, unsigned value, const char *text)
{
	const struct tga_form o = {kind, bits, false, false, false};
	struct tga_file f = make_file(&o);
	f.bytes[at] = (unsigned char)value;
	expect_refused(&f, f.size, text);
}

static void test_inconsistent_headers_are_refused(void **state)
{
	(void)state;
	expect_change_refused(KIND_COLOUR, 24, 2, 4, "pixels of kind 4 with 24 bits");
	expect_change_refused(KIND_COLOUR, 24, 2, 0, "pixels of kind 0");
	expect_change_refused(KIND_COLOUR, 24, 16, 16, "with 16 bits");
	expect_change_refused(KIND_GREY, 8, 16, 24, "pixels of kind 3 with 24 bits");
	expect_change_refused(KIND_COLOUR, 24, 17, 0x40, "interleaved");
	expect_change_refused(KIND_COLOUR, 24, 12, 0, "pixels; at most");
	expect_change_refused(KIND_COLOUR, 24, 13, 100, "too short for");
	expect_change_refused(KIND_COLOUR, 24, 0, 255, "the header ends too early");
	expect_change_refused(KIND_COLOUR, 24, 1, 2, "the palette is missing or of an unknown kind");
	expect_change_refused(KIND_MAPPED, 24, 1, 0, "the palette is missing or of an unknown kind");
	expect_change_refused(KIND_MAPPED, 24, 6, 255, "the palette ends too early");
	expect_change_refused(KIND_MAPPED, 24, 7, 16, "a palette of 16 bits");
	expect_change_refused(KIND_MAPPED, 24, 3, FIRST_INDEX + 1, "beyond the palette");
	expect_change_refused(KIND_MAPPED, 24, 3, FIRST_INDEX - 1, "beyond the palette");
	const struct tga_form o = {KIND_COLOUR, 24, true, false, false};
	struct tga_file f = make_file(&o);
	f.bytes[13] = 8; /* more pixels than the best compression could hold */
	f.bytes[15] = 8;
	expect_refused(&f, f.size, "too short for");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_every_kind_is_decoded),
		cmocka_unit_test(test_signature_identifies_unnamed_files),
		cmocka_unit_test(test_inconsistent_headers_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
