/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Hits of rays on primitives, refined in double, lie on the primitive and on the ray. Tolerances are a few roundings
 * of double times the condition number of the problem, which is stated where it is used.
 */
#include "tests/support/bodies.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static vec3 corner(const struct geom_shape *s, uint32_t prim, int k)
{
	const float *p = s->position[s->index[prim][k]];
	return (vec3){(double)p[0], (double)p[1], (double)p[2]};
}

static double distance_from_line(vec3 p, vec3 o, vec3 d)
{
	return vec3_length(vec3_cross(vec3_sub(p, o), d));
}

/* Hits lie on the triangle's plane to 1e-15 of the coordinates, and on the ray to 1e-15 over the cosine between ray
 * and normal. */
static void hits_lie_on_triangle_and_ray(void **state)
{
	(void)state;
	struct dice d = dice_for_test("surface of triangles");
	struct geom_shape s;
	body_make_ball(&s, 12, 0.7, 0.15);
	struct accel *a = body_build_accel(&s, 1);
	double worst_plane = 0, worst_line = 0;
	size_t met = 0, beside = 0;
	for (size_t i = 0; i < dice_scaled_count(100000); i++) {
		vec3 o = vec3_scale(i % 2 ? 0.3 : 3, dice_direction(&d));
		vec3 w = vec3_normalize(vec3_sub(vec3_scale(0.5, dice_direction(&d)), o));
		struct ray_end from = {.p = o, .prim = PRIM_NONE};
		struct ray_hit hit;
		if (!accel_closest(a, &from, w, 0, INFINITY, &hit))
			continue;
		met++;
		struct surface_point x;
		surface_from_hit(&s, o, w, &hit, &x);
		vec3 v0 = corner(&s, hit.prim.prim, 0), e1 = vec3_sub(corner(&s, hit.prim.prim, 1), v0);
		vec3 e2 = vec3_sub(corner(&s, hit.prim.prim, 2), v0), n = vec3_normalize(vec3_cross(e1, e2));
		worst_plane = fmax(worst_plane, fabs(vec3_dot(vec3_sub(x.p, v0), n)));
		assert_true(vec3_length(vec3_sub(n, x.ng)) < 1e-15);
		/* Beside an edge, Embree's floats may choose the neighbouring triangle: the hit is then that
		 * triangle's nearest point, within float precision. */
		double line = distance_from_line(x.p, o, w);
		if (line > 1e-9) {
			beside++;
			assert_true(line < 1e-6);
			continue;
		}
		worst_line = fmax(worst_line, line * fabs(vec3_dot(n, w)));
	}
	print_message("%zu hits: off the plane %.1e, off the ray %.1e x cos; %zu beside an edge\n", met, worst_plane,
		      worst_line, beside);
	assert_true(met > dice_scaled_count(100000) / 2);
	assert_true(worst_plane < 1e-15);
	assert_true(worst_line < 2e-15);
	assert_true(beside <= met / 10000 + 1);
	accel_free(a);
	body_fini(&s);
}

/* Points are center + radius x unit vector, so they lie on the sphere to rounding. They lie on the ray to 1e-15 over
 * the cosine; from far away, to the rounding of the distance. */
static void hits_lie_on_sphere_and_ray(void **state)
{
	(void)state;
	struct dice d = dice_for_test("surface of spheres");
	for (double distance = 0.5; distance < 2e6; distance *= 10) {
		for (double radius = 1e-6; radius < 1; radius *= 20) {
			struct geom_shape s = {.is_sphere = true,
					       .center = {0.2, -0.1, 0.05},
					       .radius = radius,
					       .normal_sign = 1,
					       .sphere_axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
			struct accel *a = body_build_accel(&s, 1);
			for (size_t i = 0; i < dice_scaled_count(500); i++) {
				vec3 o = vec3_madd(s.center, distance, dice_direction(&d));
				vec3 aim = vec3_madd(s.center, 0.9 * radius, dice_direction(&d));
				struct ray_end from = {.p = o, .prim = PRIM_NONE};
				vec3 w = vec3_normalize(vec3_sub(aim, o));
				struct ray_hit hit;
				/* For a sphere smaller than the rounding of its distance, the ray may miss in truth. */
				if (radius < 1e-14 * distance)
					continue;
				assert_true(accel_closest(a, &from, w, 0, INFINITY, &hit));
				struct surface_point x;
				surface_from_hit(&s, o, w, &hit, &x);
				double r = vec3_length(vec3_sub(x.p, s.center));
				assert_true(fabs(r - radius) < 2e-16 + 4e-16 * radius);
				assert_true(fabs(vec3_length(x.ng) - 1) < 4e-16);
				/* The hit lies on the near side, unless the ray starts inside. */
				double cosine = -vec3_dot(x.ng, w);
				assert_true(distance > radius ? cosine > 0 : cosine < 0);
				assert_true(distance_from_line(x.p, o, w) * fabs(cosine) < 1e-15 * (1 + 4 * distance));
			}
			accel_free(a);
		}
	}
}

/* A ray from a point of the sphere into it meets the other end of the chord, however flat the ray. */
static void ray_into_a_sphere_meets_the_end_of_the_chord(void **state)
{
	(void)state;
	struct dice d = dice_for_test("sphere from itself");
	struct geom_shape s = {.is_sphere = true,
			       .center = {0.3, -0.2, 0.1},
			       .radius = 0.6,
			       .normal_sign = 1,
			       .sphere_axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
	struct accel *a = body_build_accel(&s, 1);
	for (size_t i = 0; i < dice_scaled_count(50000); i++) {
		struct surface_point x = body_sample_point(&s, 0, &d), y;
		vec3 w = dice_direction(&d);
		double cosine = i % 2 ? dice_uniform(&d) : exp(dice_between(&d, log(1e-7), 0));
		w = vec3_normalize(vec3_madd(w, -vec3_dot(w, x.ng), x.ng));
		w = vec3_normalize(vec3_madd(vec3_scale(sqrt(1 - cosine * cosine), w), -cosine, x.ng));
		struct ray_end from = body_ray_end(&x);
		struct ray_hit hit;
		assert_true(accel_closest(a, &from, w, 0, INFINITY, &hit));
		surface_from_hit(&s, x.p, w, &hit, &y);
		double chord = 2 * s.radius * -vec3_dot(w, x.ng), t = vec3_dot(vec3_sub(y.p, x.p), w);
		/* The start lies on the sphere to a rounding, which moves the other crossing by this rounding over
		 * the cosine. */
		if (!(fabs(t - chord) * cosine < 1e-15))
			fail_msg("chord %.17g, %.17g found at cosine %g", chord, t, cosine);
		assert_true(distance_from_line(y.p, x.p, w) < 2e-15);
	}
	accel_free(a);
}

/* A point beside a sliver is moved across the sliver, not along it. */
static void point_beside_a_sliver_moves_across_it(void **state)
{
	(void)state;
	float position[4][3] = {{0, -1, 0}, {0x1p-20f, -1, 0}, {0x1p-20f, 1, 0}, {0, 0, 0}};
	uint32_t index[1][3] = {{0, 1, 2}};
	struct geom_shape s = {.vertex_count = 3, .triangle_count = 1, .position = position, .index = index};
	struct dice d = dice_for_test("beside a sliver");
	for (int i = 0; i < 1000; i++) {
		vec3 aim = {dice_between(&d, -0x1p-20, 0x1p-19), dice_between(&d, -1, 1), 0};
		vec3 o = {aim.x + dice_between(&d, -1, 1), aim.y + dice_between(&d, -1, 1), 1};
		struct ray_hit hit = {{0, 0, 0}, vec3_length(vec3_sub(aim, o)), 0.3, 0.3};
		struct surface_point x;
		surface_from_hit(&s, o, vec3_normalize(vec3_sub(aim, o)), &hit, &x);
		assert_true(vec3_length(vec3_sub(x.p, aim)) < 0x1p-18);
		assert_true(x.p.x >= 0 && x.p.x <= 0x1p-20 && fabs(x.p.y) <= 1);
	}
}

/* u grows with the longitude and v from pole to pole, and the derivatives of the position agree with differences. */
static void parameters_and_derivatives_agree_with_differences(void **state)
{
	(void)state;
	struct dice d = dice_for_test("surface parameters");
	struct geom_shape s = {.is_sphere = true,
			       .center = {0.3, -0.2, 0.1},
			       .radius = 0.6,
			       .normal_sign = 1,
			       .sphere_axes = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}};
	for (int i = 0; i < 1000; i++) {
		double u = dice_uniform(&d), v = dice_between(&d, 0.05, 0.95), h = 1e-5;
		struct surface_point x[3];
		for (int k = 0; k < 3; k++) {
			double phi = 2 * M_PI * (u + (k - 1) * h), theta = M_PI * v;
			vec3 l = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
			surface_on_sphere(&s, (struct prim_ref){0, 0, 0}, frame_to_world(&s.sphere_axes, l), &x[k]);
		}
		assert_true(fabs(x[1].u - u) < 1e-12 && fabs(x[1].v - v) < 1e-12);
		vec3 difference = vec3_scale(1 / (2 * h), vec3_sub(x[2].p, x[0].p));
		assert_true(vec3_length(vec3_sub(difference, x[1].axis)) < 1e-7 * vec3_length(x[1].axis));
		assert_true(fabs(vec3_dot(x[1].sh.s, x[1].sh.n)) < 1e-15 &&
			    fabs(vec3_dot(x[1].sh.t, x[1].sh.s)) < 1e-15);
	}
	float position[4][3] = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0.5f}, {0, 0, 0}},
	      uv[3][2] = {{0.1f, 0.2f}, {0.6f, 0.3f}, {0.2f, 0.9f}};
	float normal[3][3] = {{0, -0.2f, 1}, {0.3f, -0.4f, 1}, {0, -0.5f, 1}};
	uint32_t index[1][3] = {{0, 1, 2}};
	struct geom_shape t = {.vertex_count = 3,
			       .triangle_count = 1,
			       .position = position,
			       .index = index,
			       .uv = uv,
			       .normal = normal};
	struct surface_point a, b;
	surface_on_triangle(&t, (struct prim_ref){0, 0, 0}, 0.25, 0.25, &a);
	surface_on_triangle(&t, (struct prim_ref){0, 0, 0}, 0.35, 0.45, &b);
	/* The position is linear in (u,v): along a line of constant v it changes by dpdu. */
	double det = (double)(uv[1][0] - uv[0][0]) * (double)(uv[2][1] - uv[0][1]) -
		     (double)(uv[1][1] - uv[0][1]) * (double)(uv[2][0] - uv[0][0]);
	vec3 e1 = corner(&t, 0, 1), e2 = corner(&t, 0, 2);
	vec3 dpdu = vec3_scale(1 / det, vec3_sub(vec3_scale((double)(uv[2][1] - uv[0][1]), e1),
						 vec3_scale((double)(uv[1][1] - uv[0][1]), e2)));
	vec3 dpdv = vec3_scale(1 / det, vec3_sub(vec3_scale((double)(uv[1][0] - uv[0][0]), e2),
						 vec3_scale((double)(uv[2][0] - uv[0][0]), e1)));
	vec3 step = vec3_madd(vec3_scale(b.u - a.u, dpdu), b.v - a.v, dpdv);
	assert_true(vec3_length(vec3_sub(step, vec3_sub(b.p, a.p))) < 1e-6);
	assert_true(vec3_length(vec3_sub(a.axis, dpdu)) < 1e-6);
	assert_true(vec3_dot(a.sh.n, a.ng) > 0.9 && vec3_dot(a.sh.n, a.ng) < 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(hits_lie_on_triangle_and_ray),
		cmocka_unit_test(hits_lie_on_sphere_and_ray),
		cmocka_unit_test(ray_into_a_sphere_meets_the_end_of_the_chord),
		cmocka_unit_test(point_beside_a_sliver_moves_across_it),
		cmocka_unit_test(parameters_and_derivatives_agree_with_differences),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
