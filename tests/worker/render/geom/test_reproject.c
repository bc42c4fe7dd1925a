/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Projecting points back onto one primitive along a ray through a point of that primitive, against this point.
 * Tolerances: a few roundings of the coordinates over the cosine between ray and normal.
 */
#include "tests/support/bodies.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

#define POSITION_TOLERANCE (1e-14 / cosine)

static double distance_of(const struct surface_point *a, const struct surface_point *b)
{
	return vec3_length(vec3_sub(a->p, b->p));
}

/* A ray through a point of the triangle from either side gives that point. A triangle behind the start, or a ray
 * beside the triangle, gives none. */
static void reprojection_finds_the_point_of_a_triangle(void **state)
{
	(void)state;
	struct dice d = dice_for_test("points put back on triangles");
	struct geom_shape s;
	body_make_ball(&s, 6, 0.7, 0.3);
	for (size_t i = 0; i < dice_scaled_count(50000); i++) {
		struct surface_point x = body_sample_point(&s, 0, &d), y;
		vec3 o = vec3_madd(x.p, dice_between(&d, 0.01, 2), dice_direction(&d)), w = vec3_sub(x.p, o);
		double t = vec3_length(w), cosine = fabs(vec3_dot(w, x.ng)) / t;
		if (cosine < 1e-6 || fmin(fmin(x.b1, x.b2), 1 - x.b1 - x.b2) < 1e-6)
			continue;
		w = vec3_scale(1 / t, w);
		assert_true(surface_reproject(&s, x.prim, PRIM_NONE, o, w, t, &y));
		assert_true(distance_of(&x, &y) < POSITION_TOLERANCE && y.prim.shape == x.prim.shape &&
			    y.prim.prim == x.prim.prim);
		assert_true(y.b1 >= 0 && y.b2 >= 0 && y.b1 + y.b2 <= 1 + 0x1p-52);
		assert_false(surface_reproject(&s, x.prim, PRIM_NONE, o, vec3_neg(w), t, &y));
		assert_false(surface_reproject(&s, x.prim, x.prim, o, w, t, &y));
		/* Beyond the edge that joins vertices 1 and 2. */
		struct surface_point beside;
		surface_on_triangle(&s, x.prim, x.b1 + 0.6 * (1 - x.b1 - x.b2), x.b2 + 0.6 * (1 - x.b1 - x.b2),
				    &beside);
		vec3 past = vec3_sub(beside.p, o);
		assert_false(surface_reproject(&s, x.prim, PRIM_NONE, o, vec3_normalize(past), t, &y));
	}
	body_fini(&s);
}

static void reprojection_finds_the_point_of_a_sphere(void **state)
{
	(void)state;
	struct dice d = dice_for_test("points put back on spheres");
	struct geom_shape s = {.is_sphere = true,
			       .center = {0.2, -0.1, 0.3},
			       .radius = 0.4,
			       .normal_sign = 1,
			       .sphere_axes = frame_around((vec3){0, 0, 1})};
	for (size_t i = 0; i < dice_scaled_count(50000); i++) {
		struct surface_point x = body_sample_point(&s, 0, &d), y, z;
		vec3 o = vec3_madd(x.p, dice_between(&d, 0.01, 2), dice_direction(&d)), w = vec3_sub(x.p, o);
		double t = vec3_length(w), cosine = fabs(vec3_dot(w, x.ng)) / t;
		if (cosine < 1e-4)
			continue;
		w = vec3_scale(1 / t, w);
		assert_true(surface_reproject(&s, x.prim, PRIM_NONE, o, w, t, &y));
		assert_true(distance_of(&x, &y) < POSITION_TOLERANCE);
		assert_true(fabs(vec3_length(vec3_sub(y.p, s.center)) - s.radius) < 1e-15);
		/* From the sphere itself: the other end of the chord, or nothing if the ray leads outwards. */
		bool inwards = vec3_dot(w, x.ng) < 0;
		assert_int_equal(surface_reproject(&s, x.prim, x.prim, x.p, w, t, &z), inwards);
		if (!inwards)
			continue;
		double chord = -2 * s.radius * vec3_dot(w, x.ng);
		assert_true(vec3_length(vec3_sub(z.p, vec3_madd(x.p, chord, w))) < POSITION_TOLERANCE);
		/* From outside, both crossings lie ahead: the requested one is returned. */
		vec3 outside = vec3_madd(x.p, -3, w);
		assert_true(surface_reproject(&s, x.prim, PRIM_NONE, outside, w, 3 + 0.4 * chord, &y) &&
			    distance_of(&x, &y) < POSITION_TOLERANCE);
		assert_true(surface_reproject(&s, x.prim, PRIM_NONE, outside, w, 3 + 0.6 * chord, &y) &&
			    distance_of(&z, &y) < POSITION_TOLERANCE);
		assert_false(surface_reproject(&s, x.prim, PRIM_NONE, outside, vec3_neg(w), 3, &y));
		/* From the middle of the chord, only one crossing lies ahead. */
		vec3 middle = vec3_madd(x.p, 0.5 * chord, w);
		assert_true(surface_reproject(&s, x.prim, PRIM_NONE, middle, w, 0, &y) &&
			    distance_of(&z, &y) < POSITION_TOLERANCE);
		/* A ray that misses the sphere. */
		vec3 aside = vec3_normalize(vec3_cross(w, x.ng)),
		     passing = vec3_madd(vec3_madd(s.center, 0.401, aside), -2, w);
		assert_false(surface_reproject(&s, x.prim, PRIM_NONE, passing, w, 2, &y));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(reprojection_finds_the_point_of_a_triangle),
					   cmocka_unit_test(reprojection_finds_the_point_of_a_sphere)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
