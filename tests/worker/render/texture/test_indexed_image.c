/* SPDX-License-Identifier: Apache-2.0 */
/* An indexed image has the same bits as the image from which it was made, in less memory if numbers recur. */
#include "worker/render/texture/indexed_image.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Makes an image with the given count of different numbers, each at least once, in pseudo-random order. */
static struct image make_image(uint32_t numbers, uint32_t width, uint32_t height, uint32_t channels)
{
	size_t count = (size_t)width * height * channels;
	struct image i = {width, height, channels, malloc(count * sizeof *i.pixels)};
	assert_true(i.pixels && count >= numbers);
	for (size_t k = 0; k < count; k++)
		i.pixels[k] = (float)(k * 7919 % numbers) / 255;
	return i;
}

/* Returns the bytes of the arena that the copy takes. */
static size_t check_copy(const struct image *from, uint32_t index_bytes)
{
	struct arena a = {0};
	struct indexed_image i;
	struct error e;
	assert_int_equal(indexed_image_make(from, &a, &i, &e), 0);
	assert_true(i.width == from->width && i.height == from->height && i.channels == from->channels);
	assert_int_equal(i.index8 ? 1 : i.index16 ? 2 : 0, index_bytes);
	for (size_t k = 0; k < (size_t)i.width * i.height * i.channels; k++) {
		float x = indexed_image_value(&i, k);
		assert_memory_equal(&x, &from->pixels[k], sizeof x);
	}
	size_t used = a.used;
	arena_fini(&a);
	return used;
}

static void test_index_size_follows_the_count_of_numbers(void **state)
{
	(void)state;
	static const struct {
		uint32_t numbers, width, height, channels, bytes;
	} cases[] = {
		{1, 1, 1, 1, 1},	 {3, 1, 1, 3, 1},	   {255, 64, 64, 3, 1},	    {256, 64, 64, 1, 1},
		{257, 64, 64, 1, 2},	 {4000, 64, 64, 3, 2},	   {65535, 300, 300, 1, 2}, {65536, 300, 300, 1, 2},
		{65537, 300, 300, 1, 0}, {200000, 300, 300, 3, 0},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct image from = make_image(cases[i].numbers, cases[i].width, cases[i].height, cases[i].channels);
		size_t count = (size_t)from.width * from.height * from.channels;
		size_t used = check_copy(&from, cases[i].bytes);
		size_t expected = cases[i].bytes ? cases[i].bytes * count + 4 * cases[i].numbers : 4 * count;
		assert_true(used <= expected + 128); /* both are rounded up to cache lines */
		free(from.pixels);
	}
}

/* Zeros of both signs, and the smallest and largest floats, are distinct numbers. */
static void test_unusual_floats_are_distinct(void **state)
{
	(void)state;
	float x[] = {0.0f, -0.0f, 0x1p-149f, -0x1p-149f, 0x1.fffffep127f, -0x1.fffffep127f, 1, 1, -0.0f};
	check_copy(&(struct image){3, 1, 3, x}, 1);
}

static uint32_t modular_inverse(uint32_t odd)
{
	uint32_t x = odd;
	for (int i = 0; i < 5; i++) /* Newton's iteration modulo 2^32 doubles the number of correct bits */
		x *= 2 - odd * x;
	return x;
}

/* Fills x with finite floats that all hash to the same slot. */
static void fill_with_collisions(float *x, uint32_t count)
{
	uint32_t unmix = modular_inverse(0x9e3779b1u), found = 0;
	for (uint32_t low = 0; found < count; low++) {
		uint32_t bits = low * unmix;
		assert_true(low < 1u << 15);
		if ((bits >> 23 & 0xff) != 0xff)
			memcpy(&x[found++], &bits, sizeof bits);
	}
}

/* A file of colliding numbers does not take quadratic time: it is stored without indices. */
static void test_colliding_numbers_take_linear_time(void **state)
{
	(void)state;
	enum { NUMBERS = 30000, SIDE = 256 };
	struct image from = {SIDE, SIDE, 1, malloc(sizeof(float) * SIDE * SIDE)};
	assert_non_null(from.pixels);
	fill_with_collisions(from.pixels, NUMBERS);
	for (size_t k = NUMBERS; k < (size_t)SIDE * SIDE; k++)
		from.pixels[k] = from.pixels[k % NUMBERS];
	check_copy(&from, 0);
	free(from.pixels);
}

/* Nor is the whole table searched for each pixel of a file with a few colliding numbers, followed by the one that is
 * found last only. A few pixels with that number do not matter. */
static void test_distant_slots_are_not_searched_for_each_pixel(void **state)
{
	(void)state;
	enum { NUMBERS = 200, SIDE = 256, FEW = 256 };
	struct image from = {SIDE, SIDE, 1, malloc(sizeof(float) * SIDE * SIDE)};
	assert_non_null(from.pixels);
	fill_with_collisions(from.pixels, NUMBERS);
	for (size_t k = NUMBERS; k < (size_t)SIDE * SIDE; k++)
		from.pixels[k] = from.pixels[k < (size_t)SIDE * SIDE - FEW ? 0 : NUMBERS - 1];
	check_copy(&from, 1);
	for (size_t k = NUMBERS; k < (size_t)SIDE * SIDE; k++)
		from.pixels[k] = from.pixels[NUMBERS - 1];
	check_copy(&from, 0);
	free(from.pixels);
}

/* The limit applies to all images of a scene together: the arena contains those read before. */
static void test_limit_covers_all_images_of_a_scene(void **state)
{
	(void)state;
	float x[] = {1, 2, 3, 4};
	const struct image from = {2, 2, 1, x};
	struct indexed_image out;
	struct error e;
	struct arena a = {.used = IMAGE_SCENE_BYTES_MAX - 20}, full = {.used = IMAGE_SCENE_BYTES_MAX - 19};
	assert_int_equal(indexed_image_make(&from, &a, &out, &e), 0);
	assert_int_equal(indexed_image_make(&from, &full, &out, &e), -EFBIG);
	assert_string_equal(e.text, "2 x 2 pixels take 0 MB, the scene before it 4095 MB; at most 4096 MB together");
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_index_size_follows_the_count_of_numbers),
		cmocka_unit_test(test_unusual_floats_are_distinct),
		cmocka_unit_test(test_colliding_numbers_take_linear_time),
		cmocka_unit_test(test_distant_slots_are_not_searched_for_each_pixel),
		cmocka_unit_test(test_limit_covers_all_images_of_a_scene),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
