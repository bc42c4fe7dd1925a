/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tiles and images as EXR: they are read back bit by bit, through our reader and through OpenEXR's; tiles of another
 * film and truncated or damaged ones are refused and never cause a crash; images of other programs with half floats,
 * lines in reverse order or unusual channels are read; each failing allocation is an error that leaks nothing.
 */
#include "common/exr/exr_read.h"
#include "common/exr/exr_tile.h"

#include "common/base/bytes.h"
#include "common/base/mem.h"
#include "tests/support/failing_memory.h"

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { FULL_W = 200, FULL_H = 150 };

static float value_at(size_t i)
{
	return ldexpf((float)((i * 2654435761u) % 100003) - 50000, (int)(i % 61) - 30);
}

static struct tile make_tile(uint32_t x, uint32_t y, uint32_t w, uint32_t h)
{
	struct tile t = {x, y, w, h, mem_alloc((size_t)w * h * 3, sizeof(float))};
	for (size_t i = 0; i < (size_t)w * h * 3; i++)
		t.xyz[i] = value_at(i + x + y);
	return t;
}

static void tiles_are_read_back_bit_for_bit(void **unused)
{
	(void)unused;
	const uint32_t shapes[][4] = {
		{0, 0, 64, 64}, {64, 64, 64, 64}, {192, 128, 8, 22}, {199, 149, 1, 1}, {3, 7, 64, 1}};
	for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
		struct tile t = make_tile(shapes[i][0], shapes[i][1], shapes[i][2], shapes[i][3]), u;
		unsigned char *bytes;
		size_t size;
		struct error e = {""};
		assert_int_equal(exr_tile_write(&t, FULL_W, FULL_H, &bytes, &size, &e), 0);
		assert_true(size <= exr_tile_size_max(t.width, t.height));
		if (exr_tile_read(bytes, size, FULL_W, FULL_H, &u, &e) != 0)
			fail_msg("%s", e.text);
		assert_true(u.x == t.x && u.y == t.y && u.width == t.width && u.height == t.height);
		assert_memory_equal(u.xyz, t.xyz, (size_t)t.width * t.height * 3 * sizeof(float));
		mem_free(t.xyz);
		mem_free(u.xyz);
		mem_free(bytes);
	}
}

static void a_tile_is_an_image_that_any_reader_opens(void **unused)
{
	(void)unused;
	struct tile t = make_tile(64, 128, 64, 22);
	unsigned char *bytes;
	size_t size;
	struct exr_image img;
	assert_int_equal(exr_tile_write(&t, FULL_W, FULL_H, &bytes, &size, NULL), 0);
	assert_int_equal(exr_read(bytes, size, &img, NULL), 0);
	assert_int_equal(img.channel_count, 3);
	assert_string_equal(img.channel_names[1], "Y");
	assert_true(img.x == 64 && img.y == 128 && img.full_width == FULL_W && img.full_height == FULL_H);
	for (size_t i = 0; i < 64 * 22; i++)
		for (size_t c = 0; c < 3; c++)
			assert_true(img.planes[c][i] == t.xyz[i * 3 + c]);
	assert_true(get_float(bytes + size - 4) == t.xyz[64 * 22 * 3 - 1]);
	exr_image_fini(&img);
	mem_free(t.xyz);
	mem_free(bytes);
}

static void tiles_of_another_film_are_refused(void **unused)
{
	(void)unused;
	struct tile t = make_tile(64, 64, 64, 64), u;
	unsigned char *bytes;
	size_t size;
	struct error e;
	assert_int_equal(exr_tile_write(&t, FULL_W, FULL_H, &bytes, &size, NULL), 0);
	assert_int_equal(exr_tile_read(bytes, size, FULL_W + 1, FULL_H, &u, &e), -EBADMSG);
	assert_int_equal(exr_tile_read(bytes, size, 100, 100, &u, &e), -EBADMSG);
	assert_null(u.xyz);
	mem_free(t.xyz);
	mem_free(bytes);
}

/* Files cut at every length, and with changed bytes, give an error or a tile, and never a crash (also run under
 * sanitizers). */
static void broken_tiles_never_crash(void **unused)
{
	(void)unused;
	struct tile t = make_tile(192, 128, 8, 22), u;
	unsigned char *bytes, *copy;
	size_t size, refused = 0, count = 0;
	assert_int_equal(exr_tile_write(&t, FULL_W, FULL_H, &bytes, &size, NULL), 0);
	copy = mem_alloc(size, 1);
	for (size_t n = 0; n < size; n += n < 500 ? 1 : 97, count++) {
		memcpy(copy, bytes, n);
		int rc = exr_tile_read(copy, n, FULL_W, FULL_H, &u, NULL);
		refused += rc != 0;
		if (rc == 0)
			mem_free(u.xyz);
	}
	assert_int_equal(refused, count);
	for (size_t i = 0; i < 500 * 3; i++) {
		memcpy(copy, bytes, size);
		copy[i / 3] = (unsigned char)(copy[i / 3] ^ (1u << (i * 7 % 8)));
		if (exr_tile_read(copy, size, FULL_W, FULL_H, &u, NULL) == 0) {
			assert_true(u.x + u.width <= FULL_W && u.y + u.height <= FULL_H);
			mem_free(u.xyz);
		}
		struct exr_image img;
		if (exr_read(copy, size, &img, NULL) == 0)
			exr_image_fini(&img);
	}
	mem_free(copy);
	mem_free(t.xyz);
	mem_free(bytes);
}

static struct exr_image make_image(uint32_t w, uint32_t h)
{
	static struct exr_attribute attributes[] = {
		{"hslt:integrator", EXR_ATTRIBUTE_STRING, "path", 0, 0},
		{"hslt:b", EXR_ATTRIBUTE_DOUBLE, NULL, 0.1, 0},
		{"hslt:groups", EXR_ATTRIBUTE_INT, NULL, 0, 16},
	};
	struct exr_image img = {.width = w,
				.height = h,
				.channel_count = 6,
				.full_width = w + 7,
				.full_height = h + 5,
				.x = 3,
				.y = 2,
				.attribute_count = 3,
				.attributes = attributes};
	const char *const names[] = {"R", "G", "B", "error.R", "error.G", "error.B"};
	for (size_t c = 0; c < 6; c++) {
		snprintf(img.channel_names[c], sizeof img.channel_names[c], "%s", names[c]);
		img.planes[c] = mem_alloc((size_t)w * h, sizeof(float));
		for (size_t i = 0; i < (size_t)w * h; i++)
			img.planes[c][i] = value_at(i * 6 + c);
	}
	return img;
}

static void free_planes(struct exr_image *img)
{
	for (size_t c = 0; c < img->channel_count; c++)
		mem_free(img->planes[c]);
}

static void images_and_their_headers_are_read_back(void **unused)
{
	(void)unused;
	struct exr_image img = make_image(101, 37), back;
	unsigned char *bytes;
	size_t size;
	struct error e = {""};
	if (exr_write(&img, &bytes, &size, &e) != 0 || exr_read(bytes, size, &back, &e) != 0)
		fail_msg("%s", e.text);
	assert_true(back.width == 101 && back.height == 37 && back.x == 3 && back.y == 2 && back.full_width == 108);
	assert_int_equal(back.channel_count, 6);
	for (size_t c = 0; c < 6; c++)
		for (size_t k = 0; k < 6; k++)
			if (strcmp(img.channel_names[c], back.channel_names[k]) == 0)
				assert_memory_equal(img.planes[c], back.planes[k], 101 * 37 * sizeof(float));
	assert_string_equal(back.channel_names[0], "B");
	assert_int_equal(back.attribute_count, 3);
	assert_string_equal(back.attributes[0].name, "hslt:b");
	assert_true(back.attributes[0].number == 0.1);
	assert_int_equal(back.attributes[1].integer, 16);
	assert_string_equal(back.attributes[2].string, "path");
	assert_true(memmem(bytes, size, "software\0string", 16) && memmem(bytes, size, "HSLT Farm ", 10));
	exr_image_fini(&back);
	free_planes(&img);
	mem_free(bytes);
}

static bool is_read_back(const struct exr_image *img)
{
	unsigned char *bytes;
	size_t size;
	struct exr_image back;
	assert_int_equal(exr_write(img, &bytes, &size, NULL), 0);
	assert_int_equal(exr_read(bytes, size, &back, NULL), 0);
	bool same = memcmp(img->planes[0], back.planes[0], (size_t)img->width * img->height * sizeof(float)) == 0;
	exr_image_fini(&back);
	mem_free(bytes);
	return same;
}

/* Readers recognise an uncompressed chunk by its size: so a chunk that deflate leaves at the same size must be written
 * uncompressed. */
static void chunks_that_deflate_to_their_own_size_are_read_back(void **unused)
{
	(void)unused;
	float plane[64 * 3];
	struct exr_image img = {
		.width = 4, .height = 2, .channel_count = 1, .full_width = 4, .full_height = 2, .channel_names = {"R"}};
	img.planes[0] = plane;
	for (size_t i = 0; i < 8; i++)
		plane[i] = (float)(i + 1);
	assert_true(is_read_back(&img));
	/* Two dozen of these sizes and contents deflate to exactly their own size. */
	for (uint32_t w = 1; w <= 64; w++)
		for (size_t k = 1; k < 40; k++) {
			img.width = img.full_width = w;
			img.height = img.full_height = 3;
			for (size_t i = 0; i < w * 3u; i++)
				plane[i] = i % k ? (float)(i % k) : value_at(i + k);
			if (!is_read_back(&img))
				fail_msg("%u pixels wide, period %zu", w, k);
		}
}

static void failing_allocations_leak_nothing(void **unused)
{
	(void)unused;
	struct exr_image img = make_image(20, 20);
	int failures = 0;
	for (long n = 0;; n++) {
		unsigned char *bytes = NULL;
		size_t size;
		struct exr_image back;
		mem_fail_after(n);
		int rc = exr_write(&img, &bytes, &size, NULL);
		if (rc == 0)
			rc = exr_read(bytes, size, &back, NULL);
		mem_fail_after(-1);
		mem_free(bytes);
		if (rc == 0) {
			exr_image_fini(&back);
			if (failures > 5 && n > 20)
				break;
		}
		failures += rc != 0;
	}
	free_planes(&img);
}

static void foreign_images_are_read(void **unused)
{
	(void)unused;
	const char *scenes = getenv("HSLT_SCENES");
	char path[4096];
	snprintf(path, sizeof path, "%s/cornell-box/TungstenRender.exr", scenes ? scenes : "");
	FILE *f = scenes ? fopen(path, "rb") : NULL;
	if (!f) {
		print_message("skipped: HSLT_SCENES is not set, or has no cornell-box/TungstenRender.exr\n");
		skip();
	}
	unsigned char *bytes = mem_alloc(1 << 26, 1);
	size_t size = fread(bytes, 1, 1 << 26, f);
	fclose(f);
	struct exr_image img;
	struct error e;
	if (exr_read(bytes, size, &img, &e) != 0)
		fail_msg("%s", e.text);
	assert_true(img.channel_count >= 3 && img.width > 100);
	double sum = 0;
	for (size_t i = 0; i < (size_t)img.width * img.height; i++)
		sum += (double)img.planes[0][i];
	assert_true(sum / img.width / img.height > 0.01 && sum / img.width / img.height < 100);
	exr_image_fini(&img);
	mem_free(bytes);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(tiles_are_read_back_bit_for_bit),
		cmocka_unit_test(a_tile_is_an_image_that_any_reader_opens),
		cmocka_unit_test(tiles_of_another_film_are_refused),
		cmocka_unit_test(broken_tiles_never_crash),
		cmocka_unit_test(images_and_their_headers_are_read_back),
		cmocka_unit_test(chunks_that_deflate_to_their_own_size_are_read_back),
		cmocka_unit_test(failing_allocations_leak_nothing),
		cmocka_unit_test(foreign_images_are_read),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
