/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Rays among instances of one bumpy ball: plain, unevenly scaled, mirrored, turned, tiny and far away, one within
 * another, over a floor that is no instance. Checked against a search in long double over all triangles, placed by
 * the test itself: every ray from a surface or from free space must meet the same triangle at the same point, and
 * every segment must be blocked or open alike, however low it runs and however near the next surface is. At most one
 * ray in two thousand, which passes an edge by less than float precision, may meet the neighbouring triangle.
 */
#include "tests/support/bodies.h"
#include "worker/render/geom/coincide.h"
#include "worker/render/geom/coincide_find.h"

#include "common/base/mem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { INSTANCES = 6, SHAPES = INSTANCES + 1, TRIANGLES_MAX = 4096 };

typedef struct {
	long double x, y, z;
} wide;

static wide vec3_to_wide(vec3 v)
{
	return (wide){(long double)v.x, (long double)v.y, (long double)v.z};
}

static wide wide_sub(wide a, wide b)
{
	return (wide){a.x - b.x, a.y - b.y, a.z - b.z};
}

static wide wide_cross(wide a, wide b)
{
	return (wide){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static long double wide_dot(wide a, wide b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

struct scene {
	struct geom_shape ball, shape[SHAPES];
	struct placement place[SHAPES];
	uint32_t (*reversed_indices)[3];
	wide corner[SHAPES][TRIANGLES_MAX][3];
	double size[SHAPES];
	struct accel *accel;
};

static mat4 product(mat4 a, mat4 b)
{
	return mat4_mul(a, b);
}

static mat4 instance_transform(int k)
{
	const vec3 axis = {1, 2, -1};
	switch (k) {
	case 0:
		return product(mat4_translate((vec3){-0.5, 0.1, 0}), mat4_scale((vec3){0.2, 0.2, 0.2}));
	case 1:
		return product(mat4_translate((vec3){0.1, 0.3, 0.4}),
			       product(mat4_rotate(axis, 70), mat4_scale((vec3){0.3, 0.05, 0.15})));
	case 2: /* mirrored */
		return product(mat4_translate((vec3){0.5, 0.2, -0.2}),
			       product(mat4_rotate(axis, -20), mat4_scale((vec3){-0.2, 0.1, 0.2})));
	case 3: /* around the plain one */
		return product(mat4_translate((vec3){-0.5, 0.1, 0}), mat4_scale((vec3){-0.28, -0.28, -0.28}));
	case 4: /* its floats err by a thousandth of its size */
		return product(mat4_translate((vec3){0.9, -0.1, 0.3}), mat4_scale((vec3){0.0005, 0.0006, 0.0004}));
	default:
		return product(mat4_translate((vec3){-0.2, -0.4, -0.6}),
			       product(mat4_rotate(axis, 160), mat4_scale((vec3){0.1, 0.1, -0.3})));
	}
}

static wide wide_transform(const mat4 *m, const float p[3])
{
	long double out[3];
	for (int i = 0; i < 3; i++) {
		out[i] = (long double)m->m[i][3];
		for (int k = 0; k < 3; k++)
			out[i] += (long double)m->m[i][k] * (long double)p[k];
	}
	return (wide){out[0], out[1], out[2]};
}

static void reverse_winding(struct scene *s)
{
	const struct geom_shape *g = &s->ball;
	s->reversed_indices = mem_alloc(g->triangle_count, sizeof *s->reversed_indices);
	assert_non_null(s->reversed_indices);
	for (uint32_t i = 0; i < g->triangle_count; i++)
		memcpy(s->reversed_indices[i], (uint32_t[3]){g->index[i][0], g->index[i][2], g->index[i][1]},
		       sizeof s->reversed_indices[i]);
}

/* first: the transform of the first shape, so that the tree is built with one winding or the other. */
static struct scene *make_scene(int first)
{
	struct scene *s = mem_alloc(1, sizeof *s);
	struct accel_shape a[SHAPES] = {{.is_sphere = false}};
	assert_non_null(s);
	body_make_ball(&s->ball, 6, 0.8, 0.1);
	body_make_plane(&s->shape[INSTANCES], 2, 0.25, -0.125);
	reverse_winding(s);
	for (int k = 0; k < SHAPES; k++) {
		mat4 m = k < INSTANCES ? instance_transform((k + first) % INSTANCES) : mat4_identity();
		struct geom_shape *g = &s->shape[k];
		if (k < INSTANCES) {
			*g = s->ball;
			assert_true(placement_make(&s->place[k], &m, (vec3){-0.9, -0.9, -0.9}, (vec3){0.9, 0.9, 0.9}));
			g->placement = &s->place[k];
			if (s->place[k].is_mirrored)
				g->index = s->reversed_indices;
			s->size[k] = triangle_norm_max(s->place[k].half);
		} else {
			s->size[k] = 1;
		}
		a[k] = (struct accel_shape){.vertex_count = g->vertex_count,
					    .triangle_count = g->triangle_count,
					    .position = (const float(*)[3])g->position,
					    .index = (const uint32_t(*)[3])g->index,
					    .rank = SURFACE_OPAQUE,
					    .placement = g->placement};
		for (uint32_t i = 0; i < g->triangle_count; i++)
			for (int c = 0; c < 3; c++)
				s->corner[k][i][c] = wide_transform(&m, g->position[g->index[i][c]]);
	}
	struct error e = {""};
	if (accel_new(&s->accel, a, SHAPES, NULL, &e))
		fail_msg("%s", e.text);
	return s;
}

static void scene_free(struct scene *s)
{
	accel_free(s->accel);
	mem_free(s->reversed_indices);
	body_fini(&s->ball);
	body_fini(&s->shape[INSTANCES]);
	mem_free(s);
}

/* The nearest hit along o + t d, without the excluded triangles. margin: distance of the hit from the triangle's
 * edge, in barycentric coordinates. */
struct nearest_hit {
	struct prim_ref prim;
	long double t, margin;
};

static struct nearest_hit search_nearest(const struct scene *s, wide o, wide d, const struct prim_ref out[2],
					 long double t_max)
{
	struct nearest_hit best = {PRIM_NONE, t_max, 1};
	for (uint32_t k = 0; k < SHAPES; k++)
		for (uint32_t i = 0; i < s->shape[k].triangle_count; i++) {
			const wide *v = s->corner[k][i];
			wide e1 = wide_sub(v[1], v[0]), e2 = wide_sub(v[2], v[0]), h = wide_cross(d, e2);
			long double det = wide_dot(e1, h);
			if (det == 0 || (k == out[0].shape && i == out[0].prim) ||
			    (k == out[1].shape && i == out[1].prim))
				continue;
			wide from = wide_sub(o, v[0]), q = wide_cross(from, e1);
			long double u = wide_dot(from, h) / det, w = wide_dot(d, q) / det, t = wide_dot(e2, q) / det;
			if (u >= 0 && w >= 0 && u + w <= 1 && t > 1e-15L && t < best.t)
				best = (struct nearest_hit){{k, i, 0}, t, fminl(u, fminl(w, 1 - u - w))};
		}
	return best;
}

static struct surface_point point_of(const struct scene *s, struct dice *d)
{
	uint32_t k = dice_below(d, SHAPES);
	return body_sample_point(&s->shape[k], k, d);
}

/* Returns a direction, nearly half of the time one along the surface. */
static vec3 direction_leaving(const struct surface_point *x, struct dice *d)
{
	vec3 w = dice_direction(d);
	double low = dice_uniform(d) < 0.3 ? exp(dice_between(d, -20, 0)) : 1;
	return vec3_normalize(vec3_madd(w, (low - 1) * vec3_dot(w, x->ng), x->ng));
}

static struct ray_end random_ray_start(const struct scene *s, struct dice *d, vec3 *w)
{
	if (dice_uniform(d) < 0.3) {
		const struct ray_end from = {.p = vec3_scale(dice_between(d, 0.1, 30), dice_direction(d)),
					     .prim = PRIM_NONE};
		const struct surface_point aim = point_of(s, d);
		*w = vec3_normalize(vec3_sub(aim.p, from.p));
		return from;
	}
	const struct surface_point x = point_of(s, d);
	*w = direction_leaving(&x, d);
	return body_ray_end(&x);
}

static void check_closest(struct scene *s, struct dice *d, size_t n, size_t met[SHAPES], size_t *wrong)
{
	for (size_t i = 0; i < n; i++) {
		vec3 w;
		const struct ray_end from = random_ray_start(s, d, &w);
		const struct prim_ref out[2] = {from.prim, PRIM_NONE};
		struct nearest_hit expected = search_nearest(s, vec3_to_wide(from.p), vec3_to_wide(w), out, INFINITY);
		struct ray_hit hit = {.prim = PRIM_NONE};
		if (!accel_closest(s->accel, &from, w, 0, INFINITY, &hit))
			hit.prim = PRIM_NONE;
		if (hit.prim.shape != expected.prim.shape || hit.prim.prim != expected.prim.prim) {
			*wrong += 1;
			continue;
		}
		if (expected.prim.shape == PRIM_NONE.shape)
			continue;
		met[hit.prim.shape]++;
		struct surface_point x;
		surface_from_hit(&s->shape[hit.prim.shape], from.p, w, &hit, &x);
		const wide *v = s->corner[hit.prim.shape][hit.prim.prim];
		wide ng = wide_cross(wide_sub(v[1], v[0]), wide_sub(v[2], v[0])), p = vec3_to_wide(x.p);
		long double along = wide_dot(ng, vec3_to_wide(x.ng)) / sqrtl(wide_dot(ng, ng));
		/* The point lies in the triangle's plane and, as far as the slope allows, on the ray, and its normal
		 * follows the winding of the corners. */
		long double high = wide_dot(ng, wide_sub(p, v[0])) / sqrtl(wide_dot(ng, ng));
		double slope = fabs(vec3_dot(x.ng, w)),
		       off = vec3_length(vec3_sub(x.p, vec3_madd(from.p, (double)expected.t, w)));
		assert_true(fabsl(high) < 1e-15L && along > 1 - 1e-12L);
		assert_true(off * slope < 1e-13 * (1 + (double)expected.t));
		assert_true(fabs(hit.t - (double)expected.t) * slope <
			    1e-5 * s->size[hit.prim.shape] + 1e-6 * (1 + (double)expected.t));
	}
}

static void check_segments(struct scene *s, struct dice *d, size_t n, size_t *blocked, size_t *wrong)
{
	for (size_t i = 0; i < n; i++) {
		const struct surface_point a = point_of(s, d), b = point_of(s, d);
		const struct ray_end from = body_ray_end(&a), to = body_ray_end(&b);
		const struct prim_ref out[2] = {a.prim, b.prim};
		bool plane = a.prim.shape == INSTANCES && b.prim.shape == INSTANCES; /* the segment lies in the plane */
		bool expected =
			search_nearest(s, vec3_to_wide(a.p), wide_sub(vec3_to_wide(b.p), vec3_to_wide(a.p)), out, 1)
				.prim.shape != UINT32_MAX;
		*blocked += expected && !plane;
		*wrong += !plane && accel_occluded(s->accel, &from, &to) != expected;
		*wrong += !plane && accel_occluded(s->accel, &to, &from) != expected;
		vec3 w = direction_leaving(&a, d);
		const struct prim_ref own_prims[2] = {a.prim, PRIM_NONE};
		expected = search_nearest(s, vec3_to_wide(a.p), vec3_to_wide(w), own_prims, INFINITY).prim.shape !=
			   UINT32_MAX;
		*wrong += accel_occluded_to_infinity(s->accel, &from, w) != expected;
	}
}

static void rays_agree_with_a_search_among_instances(void **state)
{
	(void)state;
	for (int first = 0; first < 4; first += 2) {
		struct dice d = dice_for_test("rays among instances");
		struct scene *s = make_scene(first);
		size_t n = dice_scaled_count(4000), met[SHAPES] = {0}, wrong = 0, crossed = 0, blocked = 0;
		check_closest(s, &d, n, met, &wrong);
		check_segments(s, &d, n / 2, &blocked, &crossed);
		print_message("%zu rays: %zu differ; met", n, wrong);
		for (int k = 0; k < SHAPES; k++) {
			print_message(" %zu", met[k]);
			assert_true(met[k] > n / 100);
		}
		print_message("; %zu segments: %zu blocked, %zu differ\n", n / 2, blocked, crossed);
		assert_true(blocked > n / 10);
		assert_true(wrong <= n / 2000 + 1 && crossed <= n / 2000 + 1);
		scene_free(s);
	}
}

/* From inside a closed body nothing escapes. */
static void nothing_escapes_a_closed_instance(void **state)
{
	(void)state;
	struct dice d = dice_for_test("rays within instances");
	struct scene *s = make_scene(0);
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		uint32_t k = dice_below(&d, INSTANCES);
		const struct surface_point x = body_sample_point(&s->shape[k], k, &d);
		const struct ray_end from = body_ray_end(&x);
		vec3 w = direction_leaving(&x, &d);
		struct ray_hit hit;
		if (vec3_dot(w, x.ng) > 0)
			w = vec3_neg(w);
		assert_true(accel_closest(s->accel, &from, w, 0, INFINITY, &hit));
		assert_true(accel_occluded_to_infinity(s->accel, &from, w));
	}
	scene_free(s);
}

static void singular_instances_are_refused(void **state)
{
	(void)state;
	struct placement p;
	const vec3 low = {-1, -1, -1}, high = {1, 1, 1};
	mat4 flat = mat4_scale((vec3){1, 0, 1}), uneven = mat4_scale((vec3){1, 1e-6, 1}),
	     tiny = mat4_scale((vec3){1e-30, 1e-30, 1e-30}), fine = mat4_scale((vec3){1e-3, 1, 1});
	assert_false(placement_make(&p, &flat, low, high));
	assert_false(placement_make(&p, &uneven, low, high));
	assert_false(placement_make(&p, &tiny, low, high));
	assert_true(placement_make(&p, &fine, low, high));
}

/* Instances of a table top on a floor at height 0, where floats are exact; the tops deviate by the rounding of 0.3 in
 * their own frame. The lifted instance and the tilted one coincide with nothing; of all others, every triangle
 * coincides with the floor. */
static void coincident_instances_hide_each_other(void **state)
{
	(void)state;
	struct geom_shape floor, top;
	struct placement place[4];
	struct accel_shape a[5] = {{.is_sphere = false}};
	body_make_plane(&floor, 2, 0, 0);
	body_make_plane(&top, 4, 0, 0);
	for (uint32_t i = 0; i < top.vertex_count; i++)
		top.position[i][2] = -0.3f;
	const mat4 m[4] = {mat4_translate((vec3){0, 0, 0.3}),
			   product(mat4_scale((vec3){-0.5, 0.7, 1}), mat4_translate((vec3){0, 0, 0.3})),
			   mat4_translate((vec3){0, 0, 0.3 + 1e-5}),
			   product(mat4_rotate((vec3){1, 0, 0}, 1e-3), mat4_translate((vec3){0, 0, 0.3}))};
	for (int k = 0; k < 5; k++) {
		const struct geom_shape *g = k < 4 ? &top : &floor;
		a[k] = (struct accel_shape){.vertex_count = g->vertex_count,
					    .triangle_count = g->triangle_count,
					    .position = (const float(*)[3])g->position,
					    .index = (const uint32_t(*)[3])g->index,
					    .rank = k < 4 ? SURFACE_TRANSMITS : SURFACE_OPAQUE,
					    .placement = k < 4 ? &place[k] : NULL};
		assert_true(k == 4 || placement_make(&place[k], &m[k], (vec3){-1, -1, -0.3f}, (vec3){1, 1, -0.3f}));
	}
	struct coincidence *c;
	struct error e = {""};
	assert_int_equal(coincide_find(&c, a, 5, &e), 0);
	assert_non_null(c);
	for (uint32_t k = 0; k < 4; k++)
		for (uint32_t i = 0; i < top.triangle_count; i++) {
			const struct prim_ref prim = {k, i, 0};
			const struct triangle t = accel_triangle(&a[k], i, 0);
			vec3 p = vec3_scale(1.0 / 3, vec3_add(t.v[0], vec3_add(t.v[1], t.v[2])));
			assert_int_equal(coincide_present_prim(c, a, prim, p).shape, k < 2 ? 4 : k);
		}
	coincide_free(c);
	body_fini(&floor);
	body_fini(&top);
}

/* Returns a direction along the surface that rises by `slope`. */
static vec3 grazing_direction(struct dice *d, vec3 n, double slope)
{
	vec3 w = dice_direction(d);
	w = vec3_normalize(vec3_madd(w, -vec3_dot(w, n), n));
	return vec3_normalize(vec3_madd(w, slope, n));
}

/* Two instances of a sheet closer together than Embree's error in its frame (2^-21): rays that leave the first sheet
 * meet the second, however low, and the second hides what lies beyond it. */
static void check_sheets(struct dice *d, const mat4 *m, double gap)
{
	float position[5][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
	uint32_t index[2][3] = {{0, 1, 2}, {0, 2, 3}};
	struct placement place[2];
	mat4 upper_transform = product(*m, mat4_translate((vec3){0, 0, gap}));
	assert_true(placement_make(&place[0], m, (vec3){-1, -1, 0}, (vec3){1, 1, 0}));
	assert_true(placement_make(&place[1], &upper_transform, (vec3){-1, -1, 0}, (vec3){1, 1, 0}));
	struct geom_shape s[2] = {{.vertex_count = 4, .triangle_count = 2, .position = position, .index = index}};
	s[1] = s[0];
	s[0].placement = &place[0];
	s[1].placement = &place[1];
	struct accel *a = body_build_accel(s, 2);
	const vec3 up = placement_normal(&place[0], (vec3){0, 0, 1});
	for (size_t i = 0; i < dice_scaled_count(2000); i++) {
		const vec3 p = {dice_between(d, -0.5, 0.5), dice_between(d, -0.5, 0.5), 0};
		const struct ray_end from = {placement_point(&place[0], p), up, {0, p.y > p.x, 0}};
		vec3 w = grazing_direction(d, up, exp(dice_between(d, log(1.0 / 32), log(8))));
		const struct ray_end beyond = {.p = vec3_madd(from.p, 0.03, w), .prim = PRIM_NONE};
		struct ray_hit hit;
		assert_true(accel_closest(a, &from, w, 0, INFINITY, &hit) && hit.prim.shape == 1);
		assert_true(accel_occluded(a, &from, &beyond) && accel_occluded(a, &beyond, &from));
		assert_true(accel_occluded_to_infinity(a, &from, w));
	}
	accel_free(a);
}

static void rays_meet_a_near_instance_of_a_sheet(void **state)
{
	(void)state;
	struct dice d = dice_for_test("instances of a sheet");
	const mat4 turned = product(mat4_translate((vec3){0.2, -0.1, 0.3}), mat4_rotate((vec3){1, 2, -1}, 50));
	const vec3 sizes[] = {{1, 1, 1}, {0.5, 0.25, 0.4}, {0.3, 0.3, -0.6}, {0.25, 0.25, 0.03}};
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
		for (double gap = 0x1p-22; gap < 0x1p-15; gap *= 2) {
			mat4 m = mat4_scale(sizes[i]);
			check_sheets(&d, &m, gap);
			m = product(turned, m);
			check_sheets(&d, &m, gap);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rays_agree_with_a_search_among_instances),
		cmocka_unit_test(nothing_escapes_a_closed_instance),
		cmocka_unit_test(singular_instances_are_refused),
		cmocka_unit_test(coincident_instances_hide_each_other),
		cmocka_unit_test(rays_meet_a_near_instance_of_a_sheet),
	};
	return cmocka_run_group_tests_name("instances", tests, NULL, NULL);
}
