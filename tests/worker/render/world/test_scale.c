/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The same scene in other units and at other positions. Scalings by a power of two and translations that are exact in
 * double give the same rescaled world, and so the same bits. Others differ by roundings of the coordinates, 1e-16 of
 * the distance from the origin (1e-11 of the size of a scene that lies 1e5 sizes away). A path near an edge can turn
 * such a rounding into a change of its whole value; so most pixels must agree to 1e-5, and the mean to the amount
 * that a few paths can change.
 */
#include "worker/render/render.h"
#include "tests/support/leases.h"
#include "tests/support/placed_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = PLACED_SCENE_SIDE };

static struct world *placed_world(double s, double m)
{
	return placed_scene_make(s, m, "<bsdf type='dielectric'/>", "");
}

static void test_image_does_not_depend_on_scale_and_position(void **state)
{
	(void)state;
	static const struct {
		double scale, offset;
		bool is_exact;
	} cases[] = {
		{0x1p-13, 0, true},	 {0x1p13, 0, true},	  {1, 0x1p17, true}, {0x1p-13, 0x1p4, true},
		{0x1p13, -0x1p30, true}, {1e-4, 0, false},	  {1e4, 0, false},   {1, 1e5, false},
		{3, 1e5 / 7, false},	 {1e-4, 10.0 / 3, false},
	};
	float *reference = leases_render_image(placed_world(1, 0), SIDE, 32, 6);
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		float *image = leases_render_image(placed_world(cases[i].scale, cases[i].offset), SIDE, 32, 6);
		size_t differ = 0;
		double a = 0, b = 0;
		for (size_t k = 0; k < (size_t)SIDE * SIDE * 3; k++) {
			double x = (double)reference[k], y = (double)image[k];
			a += x;
			b += y;
			differ += cases[i].is_exact ? x != y : !(fabs(x - y) <= 1e-5 * (x + y));
		}
		print_message("x %g + %g: %zu of %d values differ, the mean by %.1e\n", cases[i].scale, cases[i].offset,
			      differ, SIDE * SIDE * 3, b / a - 1);
		assert_true(a > 0);
		if (cases[i].is_exact)
			assert_int_equal(differ, 0);
		assert_true(differ < SIDE * SIDE * 3 / 20);
		assert_true(fabs(b / a - 1) < 1e-3);
		free(image);
	}
	free(reference);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_image_does_not_depend_on_scale_and_position)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
