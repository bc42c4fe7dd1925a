/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Rays that begin and end on surfaces: no ray meets the surface point from which it starts, none slips through a
 * closed body, and segments are blocked exactly by the surfaces between their ends, except for segments that pass an
 * edge by less than float precision. Checked against a search over all triangles in double. Deterministic: every
 * count below is exact; no rate is estimated.
 */
#include "common/base/liveness.h"
#include "tests/support/bodies.h"
#include "worker/render/geom/accel.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static struct ray_end ray_end_in_space(vec3 p)
{
	return (struct ray_end){.p = p, .prim = PRIM_NONE};
}

static vec3 vertex_of(const struct geom_shape *s, uint32_t prim, int k)
{
	const float *p = s->position[s->index[prim][k]];
	return (vec3){(double)p[0], (double)p[1], (double)p[2]};
}

/* Returns a random direction into the half space of n. */
static vec3 random_direction_above(struct dice *d, vec3 n)
{
	vec3 w = dice_direction(d);
	return vec3_dot(w, n) < 0 ? vec3_neg(w) : w;
}

/* Returns a direction along the surface that rises by `slope`. */
static vec3 grazing_direction(struct dice *d, vec3 n, double slope)
{
	vec3 w = dice_direction(d);
	w = vec3_normalize(vec3_madd(w, -vec3_dot(w, n), n));
	return vec3_normalize(vec3_madd(w, slope, n));
}

/* Rays leave a bumpy closed mesh: each hit must also be found by a search in double, and each hit of that search by
 * the ray. */
static void rays_from_a_bumpy_mesh_agree_with_a_search_in_double(void **state)
{
	(void)state;
	struct dice d = dice_for_test("outside of mesh");
	struct geom_shape s;
	body_make_ball(&s, 24, 0.7, 0.15);
	struct accel *a = body_build_accel(&s, 1);
	size_t n = dice_scaled_count(100000), false_hits = 0, compared = 0, wrong = 0, hits = 0;
	for (size_t i = 0; i < n; i++) {
		struct surface_point x = body_sample_point(&s, 0, &d);
		vec3 w = i % 4 ? random_direction_above(&d, x.ng)
			       : grazing_direction(&d, x.ng, exp(dice_between(&d, log(1e-6), 0)));
		struct ray_end from = body_ray_end(&x);
		struct ray_hit hit;
		bool met = accel_closest(a, &from, w, 0, INFINITY, &hit);
		hits += met;
		if (met) {
			vec3 v0 = vertex_of(&s, hit.prim.prim, 0);
			vec3 m = vec3_normalize(vec3_cross(vec3_sub(vertex_of(&s, hit.prim.prim, 1), v0),
							   vec3_sub(vertex_of(&s, hit.prim.prim, 2), v0)));
			/* A ray cannot meet a triangle whose plane lies behind its start. */
			double height = vec3_dot(vec3_sub(v0, x.p), m), speed = vec3_dot(w, m);
			false_hits += hit.prim.prim == x.prim.prim || height / speed < -1e-12;
		}
		if (i % 50)
			continue;
		uint32_t prim = 0;
		double nearest = body_hit_distance(&s, x.p, w, 1e-9, &prim);
		compared++;
		bool same = met ? hit.prim.prim == prim || fabs(nearest - hit.t) < 1e-5 : isinf(nearest);
		wrong += !same;
	}
	print_message(
		"%zu rays, %zu met the body again, %zu of them falsely; %zu of %zu differ from the search in double\n",
		n, hits, false_hits, wrong, compared);
	assert_int_equal(false_hits, 0);
	assert_int_equal(wrong, 0);
	accel_free(a);
	body_fini(&s);
}

static void check_closed(const char *name, const struct geom_shape *s, double within)
{
	struct dice d = dice_for_test(name);
	struct accel *a = body_build_accel(s, 1);
	size_t n = dice_scaled_count(100000), leaks = 0;
	for (size_t i = 0; i < n; i++) {
		struct surface_point x = body_sample_point(s, 0, &d);
		vec3 inwards = vec3_scale(-s->normal_sign, x.ng);
		struct ray_end from =
			i % 2 ? body_ray_end(&x)
			      : ray_end_in_space(vec3_scale(within * dice_uniform(&d), dice_direction(&d)));
		vec3 w = i % 2 ? random_direction_above(&d, inwards) : dice_direction(&d);
		if (i % 8 == 7)
			w = grazing_direction(&d, inwards, exp(dice_between(&d, log(1e-6), 0)));
		struct ray_hit hit;
		leaks += !accel_closest(a, &from, w, 0, INFINITY, &hit);
		leaks += !accel_occluded_to_infinity(a, &from, w);
	}
	print_message("%s: %zu leaks of %zu\n", name, leaks, n);
	assert_int_equal(leaks, 0);
	accel_free(a);
}

static void nothing_slips_through_a_closed_body(void **state)
{
	(void)state;
	struct geom_shape s;
	body_make_ball(&s, 24, 0.7, 0.15);
	check_closed("inside of mesh", &s, 0.55);
	body_fini(&s);
	struct geom_shape ball = {.is_sphere = true, .center = {0.3, -0.2, 0.1}, .radius = 0.6, .normal_sign = 1};
	check_closed("inside of sphere", &ball, 0.2);
	ball.normal_sign = -1;
	check_closed("inside of sphere turned inside out", &ball, 0.2);
	struct geom_shape tiny = {.is_sphere = true, .center = {0.7, 0.6, 0.5}, .radius = 1e-6, .normal_sign = 1};
	struct dice d = dice_for_test("tiny sphere");
	struct accel *a = body_build_accel(&tiny, 1);
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		struct surface_point x = body_sample_point(&tiny, 0, &d);
		struct ray_end from = body_ray_end(&x);
		struct ray_hit hit;
		assert_false(accel_closest(a, &from, random_direction_above(&d, x.ng), 0, INFINITY, &hit));
		assert_true(accel_closest(a, &from, random_direction_above(&d, vec3_neg(x.ng)), 0, INFINITY, &hit));
		assert_true(hit.t <= 2.0001 * tiny.radius);
	}
	accel_free(a);
}

/* Many triangles in one plane: rays from any of them, on either side and however low, meet none of the others. The
 * float vertices lie exactly in their planes: a horizontal one through the origin, tilted ones, and one far from the
 * origin. */
static void rays_from_a_plane_meet_no_neighbour(void **state)
{
	(void)state;
	const double tilt[][3] = {{0, 0, 0}, {0.5, -0.25, 0}, {0.375, 0.625, 0}, {0, 0, 0.75}};
	for (size_t k = 0; k < sizeof tilt / sizeof tilt[0]; k++) {
		struct dice d = dice_for_test("plane");
		struct geom_shape s;
		body_make_plane(&s, 64, tilt[k][0], tilt[k][1]);
		for (uint32_t i = 0; i < s.vertex_count; i++)
			s.position[i][2] += (float)tilt[k][2];
		struct accel *a = body_build_accel(&s, 1);
		size_t n = dice_scaled_count(25000), met = 0;
		for (size_t i = 0; i < n; i++) {
			struct surface_point x = body_sample_point(&s, 0, &d);
			vec3 up = i % 2 ? x.ng : vec3_neg(x.ng);
			vec3 w = i % 3 ? grazing_direction(&d, up, i % 3 == 1 ? 1e-6 : 1e-4)
				       : random_direction_above(&d, up);
			struct ray_end from = body_ray_end(&x);
			struct ray_hit hit;
			met += accel_closest(a, &from, w, 0, INFINITY, &hit);
			met += accel_occluded_to_infinity(a, &from, w);
			struct ray_end to = ray_end_in_space(vec3_madd(x.p, dice_uniform(&d), w));
			met += accel_occluded(a, &from, &to);
			met += accel_occluded(a, &to, &from);
		}
		print_message("plane %zu: %zu of %zu met their own plane\n", k, met, 4 * n);
		assert_int_equal(met, 0);
		accel_free(a);
		body_fini(&s);
	}
}

static bool is_hidden_by_mesh(const struct geom_shape *s, vec3 a, vec3 b)
{
	uint32_t prim;
	return !s->is_sphere && body_hit_distance(s, a, vec3_sub(b, a), 1e-9, &prim) < 1 - 1e-9;
}

/* Two points on the surface of a convex body see each other; with a ball in the middle, the two points do not see
 * each other if their line passes through the ball. */
static void check_segments(const char *name, const struct geom_shape *body)
{
	struct dice d = dice_for_test(name);
	struct geom_shape both[2] = {
		*body, {.is_sphere = true, .center = {0.05, 0.02, -0.03}, .radius = 0.2, .normal_sign = 1}};
	struct accel *open = body_build_accel(both, 1), *blocked = body_build_accel(both, 2);
	size_t n = dice_scaled_count(50000), unseen = 0, seen = 0, tried = 0;
	for (size_t i = 0; i < n; i++) {
		struct surface_point x = body_sample_point(body, 0, &d), y = body_sample_point(body, 0, &d);
		struct ray_end from = body_ray_end(&x), to = body_ray_end(&y);
		if (!body->is_sphere && x.prim.prim == y.prim.prim)
			continue;
		if (accel_occluded(open, &from, &to)) /* the mesh has valleys: does the search in double agree? */
			unseen += !is_hidden_by_mesh(body, x.p, y.p);
		else if (i % 50 == 0)
			unseen += is_hidden_by_mesh(body, x.p, y.p);
		vec3 line = vec3_sub(y.p, x.p), c = vec3_sub(both[1].center, x.p);
		double t = vec3_dot(c, line) / vec3_dot(line, line);
		if (vec3_length(vec3_sub(c, vec3_scale(t, line))) > 0.999 * both[1].radius)
			continue;
		tried++;
		seen += !accel_occluded(blocked, &from, &to);
		/* Segments to and from the ball: points on its far side are hidden, points on its near side are not. */
		struct surface_point z = body_sample_point(&both[1], 1, &d);
		struct ray_end ball = body_ray_end(&z);
		bool hidden = vec3_dot(vec3_sub(x.p, z.p), z.ng) < 0;
		unseen += accel_occluded(blocked, &from, &ball) != hidden;
		unseen += accel_occluded(blocked, &ball, &from) != hidden;
	}
	print_message("%s: %zu falsely hidden, %zu of %zu falsely seen\n", name, unseen, seen, tried);
	/* A segment that passes an edge of the mesh by less than float precision may be taken to meet it. */
	assert_true(unseen <= 1 + n / 20000);
	assert_int_equal(seen, 0);
	assert_true(tried > n / 50);
	accel_free(open);
	accel_free(blocked);
}

static void segments_are_blocked_by_what_lies_between(void **state)
{
	(void)state;
	struct geom_shape s;
	body_make_ball(&s, 12, 0.7, 0);
	check_segments("segments in a mesh", &s);
	body_fini(&s);
	struct geom_shape ball = {.is_sphere = true, .radius = 0.7, .normal_sign = -1};
	check_segments("segments in a sphere", &ball);
}

/* From 1e6 radii away, every ray has the hit that a search in double finds, and a ray that misses the body has none. */
static void distant_rays_agree_with_a_search_in_double(void **state)
{
	(void)state;
	struct dice d = dice_for_test("far away");
	struct geom_shape s[2] = {{0}, {.is_sphere = true, .center = {0.1, 0.1, 0.1}, .radius = 0.3, .normal_sign = 1}};
	body_make_ball(&s[0], 10, 0.7, 0.15);
	struct accel *mesh = body_build_accel(s, 1), *sphere = body_build_accel(s + 1, 1);
	size_t n = dice_scaled_count(4000), wrong = 0, met_mesh = 0, met_sphere = 0;
	for (size_t i = 0; i < n; i++) {
		double distance = i % 2 ? 1e6 : 1e3;
		vec3 axis = dice_direction(&d), aim = vec3_scale(0.9 * cbrt(dice_uniform(&d)), dice_direction(&d));
		struct ray_end from = ray_end_in_space(vec3_scale(distance, axis)),
			       to = ray_end_in_space(vec3_scale(-distance, axis));
		vec3 w = vec3_normalize(vec3_sub(aim, from.p));
		to.p = vec3_madd(from.p, 2 * distance, w);
		struct ray_hit hit;
		uint32_t prim = 0;
		double t = body_hit_distance(s, from.p, w, 0, &prim);
		bool met = accel_closest(mesh, &from, w, 0, INFINITY, &hit);
		met_mesh += met;
		wrong += met != (bool)isfinite(t) || (met && !(fabs(hit.t - t) < 1e-5 + 1e-15 * distance));
		wrong += accel_occluded(mesh, &from, &to) != met;
		vec3 oc = vec3_sub(s[1].center, from.p);
		double pass = vec3_length(vec3_cross(oc, w)), radius = s[1].radius;
		if (fabs(pass - radius) < 1e-8)
			continue;
		met = accel_closest(sphere, &from, w, 0, INFINITY, &hit);
		met_sphere += met;
		double root = vec3_dot(oc, w) - sqrt(fmax(radius * radius - pass * pass, 0));
		wrong += met != (pass < radius) || (met && !(fabs(hit.t - root) < 1e-4));
		wrong += accel_occluded(sphere, &from, &to) != met;
	}
	print_message("%zu wrong; %zu and %zu of %zu met mesh and sphere\n", wrong, met_mesh, met_sphere, n);
	assert_int_equal(wrong, 0);
	assert_true(met_mesh > n / 4 && met_sphere > n / 20);
	accel_free(mesh);
	accel_free(sphere);
	body_fini(&s[0]);
}

/* Rays that just touch a sphere and rays that just miss it, including positions at which the sphere touches its
 * bounding box. */
static void rays_that_touch_a_sphere_hit_and_others_miss(void **state)
{
	(void)state;
	struct dice d = dice_for_test("silhouettes");
	for (double radius = 1; radius > 1e-7; radius /= 30) {
		/* Other spheres are added because Embree ignores the bounding box of a single primitive. */
		struct geom_shape all[12],
			s = {.is_sphere = true, .center = {0.4, -0.7, 0.3}, .radius = radius, .normal_sign = 1};
		for (int i = 0; i < 12; i++)
			all[i] = (struct geom_shape){
				.is_sphere = true, .center = {40, 40, 40 + i}, .radius = 1e-3, .normal_sign = 1};
		all[5] = s;
		struct accel *a = body_build_accel(all, 12);
		const vec3 poles[6] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
		for (size_t i = 0; i < dice_scaled_count(5000); i++) {
			vec3 side = vec3_normalize(
				vec3_madd(poles[i % 6], dice_uniform(&d) < 0.5 ? 0 : 0.01, dice_direction(&d)));
			vec3 w = vec3_normalize(vec3_cross(side, dice_direction(&d)));
			for (int in = 0; in < 2; in++) {
				vec3 touch = vec3_madd(s.center, radius * (in ? 1 - 1e-7 : 1 + 1e-7), side);
				struct ray_end from = ray_end_in_space(vec3_madd(touch, -3, w)),
					       to = ray_end_in_space(vec3_madd(touch, 3, w));
				struct ray_hit hit;
				assert_int_equal(accel_closest(a, &from, w, 0, INFINITY, &hit), in);
				assert_int_equal(accel_occluded(a, &from, &to), in);
				assert_int_equal(accel_occluded_to_infinity(a, &from, w), in);
			}
		}
		accel_free(a);
	}
}

/* A square cut into slivers of aspect ratio 1e6 lets no more rays through than one of two triangles; triangles
 * without area do no harm. */
static void slivers_leak_no_rays(void **state)
{
	(void)state;
	enum { STRIPS = 64 };
	struct dice d = dice_for_test("slivers");
	struct geom_shape s;
	body_make_plane(&s, STRIPS, 0, 0);
	/* Strips of width 2^-19 and length 2 in the middle; two wide strips cover the rest. */
	s.vertex_count = s.triangle_count = 0;
	for (uint32_t i = 0; i <= STRIPS; i++) {
		double x = i == 0 ? -1 : i == STRIPS ? 1 : ((double)i - STRIPS / 2) * 0x1p-19;
		for (int k = 0; k < 2; k++)
			memcpy(s.position[s.vertex_count++], (float[3]){(float)x, k ? 1 : -1, 0}, sizeof s.position[0]);
	}
	for (uint32_t i = 0; i < STRIPS; i++) {
		memcpy(s.index[s.triangle_count++], (uint32_t[3]){2 * i, 2 * i + 2, 2 * i + 3}, sizeof s.index[0]);
		memcpy(s.index[s.triangle_count++], (uint32_t[3]){2 * i, 2 * i + 3, 2 * i + 1}, sizeof s.index[0]);
		memcpy(s.index[s.triangle_count++], (uint32_t[3]){2 * i, 2 * i, 2 * i + 1}, sizeof s.index[0]);
		memcpy(s.index[s.triangle_count++], (uint32_t[3]){2 * i, 2 * i + 1, 2 * i}, sizeof s.index[0]);
	}
	struct accel *a = body_build_accel(&s, 1);
	size_t n = dice_scaled_count(100000), leaks = 0, off = 0;
	for (size_t i = 0; i < n; i++) {
		double reach = i % 2 ? 0x1p-14 : 0.999;
		vec3 aim = {dice_between(&d, -reach, reach), dice_between(&d, -0.999, 0.999), 0};
		vec3 o = {dice_between(&d, -1, 1), dice_between(&d, -1, 1), dice_between(&d, 0.1, 1)};
		struct ray_end from = ray_end_in_space(o);
		vec3 w = vec3_normalize(vec3_sub(aim, o));
		struct ray_hit hit;
		if (!accel_closest(a, &from, w, 0, INFINITY, &hit)) {
			leaks++;
			continue;
		}
		struct surface_point x;
		surface_from_hit(&s, o, w, &hit, &x);
		/* Embree's edge tests are in float, at coordinates of about 1. */
		off += !(vec3_length(vec3_sub(x.p, aim)) < 1e-6) || !(fabs(x.ng.z) == 1);
	}
	print_message("%zu leaks, %zu misplaced of %zu\n", leaks, off, n);
	assert_int_equal(leaks, 0);
	assert_int_equal(off, 0);
	accel_free(a);
	body_fini(&s);
}

/* A long build reports progress to its liveness counter. */
static void long_build_reports_progress(void **state)
{
	(void)state;
	atomic_ullong ticks = 0;
	struct geom_shape s;
	body_make_ball(&s, 200, 0.7, 0.15);
	liveness_counter = &ticks;
	struct accel *a = body_build_accel(&s, 1);
	liveness_counter = NULL;
	print_message("%llu ticks for %u triangles\n", atomic_load(&ticks), s.triangle_count);
	assert_true(atomic_load(&ticks) >= s.triangle_count / 4096);
	accel_free(a);
	body_fini(&s);
}

/* Two sheets closer together than float precision in their scene, so that a ray in float begins beyond the second
 * sheet: rays that leave the first sheet meet the second all the same, however low, and the second hides what lies
 * beyond it. */
static void rays_meet_a_sheet_closer_than_float_precision(void **state)
{
	(void)state;
	struct dice d = dice_for_test("sheets");
	static const double gaps[] = {0x1p-23, 0x1p-22, 0x1p-21, 0x1p-20, 0x1p-16};
	for (size_t k = 0; k < sizeof gaps / sizeof *gaps; k++) {
		float position[2][5][3] = {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}};
		uint32_t index[2][3] = {{0, 1, 2}, {0, 2, 3}};
		struct geom_shape s[2] = {{.vertex_count = 4, .triangle_count = 2, .index = index}};
		s[0].position = position[0];
		memcpy(position[1], position[0], sizeof position[0]);
		for (int i = 0; i < 4; i++)
			position[1][i][2] = (float)gaps[k];
		s[1] = s[0];
		s[1].position = position[1];
		struct accel *a = body_build_accel(s, 2);
		const vec3 up = {0, 0, 1};
		for (size_t i = 0; i < dice_scaled_count(20000); i++) {
			struct ray_end from = {
				{dice_between(&d, -0.5, 0.5), dice_between(&d, -0.5, 0.5), 0}, up, {0, 0, 0}};
			from.prim.prim = from.p.y > from.p.x;
			vec3 w = grazing_direction(&d, up, exp(dice_between(&d, log(1.0 / 32), log(8))));
			struct ray_end above = ray_end_in_space(vec3_madd(from.p, 0.2, w));
			struct ray_hit hit;
			assert_true(accel_closest(a, &from, w, 0, INFINITY, &hit) && hit.prim.shape == 1);
			assert_true(accel_occluded(a, &from, &above) && accel_occluded(a, &above, &from));
			assert_true(accel_occluded_to_infinity(a, &from, w));
		}
		accel_free(a);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rays_from_a_bumpy_mesh_agree_with_a_search_in_double),
		cmocka_unit_test(nothing_slips_through_a_closed_body),
		cmocka_unit_test(rays_from_a_plane_meet_no_neighbour),
		cmocka_unit_test(segments_are_blocked_by_what_lies_between),
		cmocka_unit_test(distant_rays_agree_with_a_search_in_double),
		cmocka_unit_test(slivers_leak_no_rays),
		cmocka_unit_test(rays_that_touch_a_sphere_hit_and_others_miss),
		cmocka_unit_test(long_build_reports_progress),
		cmocka_unit_test(rays_meet_a_sheet_closer_than_float_precision),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
