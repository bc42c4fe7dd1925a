/* SPDX-License-Identifier: Apache-2.0 */
/* The sRGB curve against the image reader's inverse of it, exposure, and the counts of values that no screen can show;
 * expected bytes are worked out by hand. */
#include "worker/cli/image/tonemap.h"

#include "worker/render/image/srgb.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static void curve_inverts_that_of_the_reader(void **unused)
{
	(void)unused;
	/* The standard's two rounded thresholds leave a step of 3e-8 between the two pieces of the curve. */
	for (int i = 0; i <= 1000; i++)
		assert_true(fabs(tonemap_srgb(srgb_to_linear(i / 1000.0)) - i / 1000.0) < 1e-7);
}

static void every_byte_is_reproduced(void **unused)
{
	(void)unused;
	for (int i = 0; i < 256; i++) {
		float value = (float)srgb_to_linear(i / 255.0);
		const float *rgb[3] = {&value, &value, &value};
		unsigned char out[3];
		tonemap_image(rgb, 1, 0, out);
		assert_true(out[0] == i && out[1] == i && out[2] == i);
	}
}

static void exposure_doubles_values_for_each_stop(void **unused)
{
	(void)unused;
	/* 0.21404 is the linear value of middle grey, 127.5 of 255; a quarter of it is 65, four times it 238. */
	const float r[2] = {0.2140f, 0.0535f}, g[2] = {0.2142f, 0}, b[2] = {1, 0.4f};
	const float *rgb[3] = {r, g, b};
	unsigned char out[6];
	struct tonemap_counts n = tonemap_image(rgb, 2, 0, out);
	const unsigned char plain[6] = {127, 128, 255, 65, 0, 170};
	assert_memory_equal(out, plain, 6);
	assert_true(n.above == 0 && n.below == 0 && n.nan == 0 && n.infinite == 0);
	n = tonemap_image(rgb, 2, 2, out);
	const unsigned char brighter[6] = {238, 238, 255, 127, 0, 255};
	assert_memory_equal(out, brighter, 6);
	assert_int_equal(n.above, 2);
}

static void values_that_no_screen_can_show_are_counted(void **unused)
{
	(void)unused;
	const float r[2] = {NAN, FLT_MAX}, g[2] = {INFINITY, -FLT_MIN}, b[2] = {-INFINITY, -3};
	const float *rgb[3] = {r, g, b};
	unsigned char out[6];
	struct tonemap_counts n = tonemap_image(rgb, 2, 100, out);
	const unsigned char wanted[6] = {0, 255, 0, 255, 0, 0};
	assert_memory_equal(out, wanted, 6);
	assert_true(n.nan == 1 && n.infinite == 2 && n.above == 1 && n.below == 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(curve_inverts_that_of_the_reader),
		cmocka_unit_test(every_byte_is_reproduced),
		cmocka_unit_test(exposure_doubles_values_for_each_stop),
		cmocka_unit_test(values_that_no_screen_can_show_are_counted),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
