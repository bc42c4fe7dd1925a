/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a medium lets through: Beer and Lambert's law as the limit of many thin layers that each take their share, its
 * values at the ends of all ranges, and the units of length. Media of many shapes have a number each, those that are
 * referred to one.
 */
#include "worker/render/medium/medium.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static double through(double sigma, double per_length, double distance)
{
	const struct medium m = {color_constant(sigma), per_length};
	const struct wavelengths w = wavelengths_sample(0.3);
	spectrum t = medium_transmittance(&m, distance, &w);
	for (int i = 1; i < SPECTRUM_LANES; i++)
		assert_true(t.v[i] == t.v[0]);
	return t.v[0];
}

/* (1 - sigma d / n)^n = exp(-sigma d) (1 - (sigma d)^2 / 2n + ...). */
static void test_layers(void **state)
{
	(void)state;
	enum { LAYERS = 1 << 20 };
	for (double depth = 0.01; depth < 5; depth *= 1.7) {
		double left = 1;
		for (int i = 0; i < LAYERS; i++)
			left *= 1 - depth / LAYERS;
		double found = through(0.25, 2, 2 * depth), bound = depth * depth / LAYERS + 1e-9;
		assert_true(fabs(left / found - 1) < bound);
	}
}

static void test_ends(void **state)
{
	(void)state;
	assert_true(through(0, 1, INFINITY) == 1);
	assert_true(through(1, 0, INFINITY) == 1);
	assert_true(through(1e-200, 1e-200, INFINITY) == 1); /* their product is 0 */
	assert_true(through(1e-200, 1, INFINITY) == 0);
	assert_true(through(1, 1, 0) == 1);
	assert_true(through(1e30, 1e30, 1e30) == 0);
}

#define AMBER(attribute)     \
	"<medium " attribute \
	" type='homogeneous'><float name='sigma_s' value='0'/><float name='sigma_a' value='1'/></medium>"

/* Every third shape has a medium of its own inside, every third the shared one outside. */
static void test_numbers(void **state)
{
	(void)state;
	enum { SHAPES = 300, ROOM = 320 };
	char *text = malloc(SHAPES * ROOM), *at = text;
	assert_non_null(text);
	for (int i = 0; i < SHAPES; i++)
		at += snprintf(at, ROOM, "<shape type='sphere'><point name='center' x='%d' y='0' z='0'/>%s</shape>",
			       3 * i,
			       i % 3 == 0   ? AMBER("name='interior'")
			       : i % 3 == 1 ? "<ref name='exterior' id='shared'/>"
					    : "");
	struct world *w = world_of_text(8, 8, SENSOR("0,0,9", "0,0,0") "<emitter type='constant'/>%s%s",
					AMBER("id='shared'"), text);
	free(text);
	assert_int_equal(w->media_count, SHAPES / 3 + 1);
	for (uint32_t i = 0; i < SHAPES; i++) {
		assert_int_equal(w->parts[i].exterior, i % 3 == 1 ? 2 : 0);
		assert_int_equal(w->parts[i].interior, i == 0 ? 1 : i % 3 == 0 ? i / 3 + 2 : 0);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_layers),
		cmocka_unit_test(test_ends),
		cmocka_unit_test(test_numbers),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
