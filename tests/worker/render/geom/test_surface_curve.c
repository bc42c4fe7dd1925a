/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Curves as they are traced: Embree's hits against a search through all cones in double, from far away, from inside
 * and from the surface itself; points of the surface, projected back along rays; memory use, and equal bits of two
 * trees.
 */
#include "common/base/mem.h"
#include "tests/support/bodies.h"
#include "tests/support/strands.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { STRANDS = 3 };

/* Several strands around each other, all within the unit sphere, of ordinary thickness or as thin as hair. */
static void make_strand(struct strand *s, struct geom_shape *g, double radius, struct dice *d)
{
	for (int i = 0; i < STRANDS; i++) {
		strand_make_random(&s[i], 12, 0.8, (const double[]){0.05, 0.1}, (const double[]){radius, 1.5 * radius},
				   d);
		if (i == 1)
			strand_set_tangents(&s[i], 0.1, d);
		g[i] = (struct geom_shape){.curves = &s[i].curves, .normal_sign = i == 2 ? -1 : 1};
	}
}

static bool search_nearest(const struct strand *s, const struct ray_end *from, vec3 w, double t_max,
			   struct curve_crossing *at, struct prim_ref *prim)
{
	bool any = false;
	for (uint32_t k = 0; k < STRANDS; k++)
		for (uint32_t i = 0; i < s[k].curves.count; i++) {
			struct curve_ray r = {.o = from->p,
					      .d = w,
					      .starts_on_curve = from->prim.shape == k,
					      .start_prim = from->prim.prim,
					      .t_max = any ? at->t : t_max};
			if (!curves_intersect(&s[k].curves, i, &r, at))
				continue;
			any = true;
			*prim = (struct prim_ref){k, i, 0};
		}
	return any;
}

static vec3 direction_to_strand(const struct strand *s, struct dice *d)
{
	const struct strand *k = &s[dice_below(d, STRANDS)];
	const float *p = k->point[dice_below(d, k->curves.point_count)], *q = p == k->point[0] ? p : p - 4;
	double x = dice_uniform(d);
	vec3 a = {(double)p[0], (double)p[1], (double)p[2]}, b = {(double)q[0], (double)q[1], (double)q[2]};
	return vec3_madd(vec3_madd(vec3_scale(x, a), 1 - x, b), 1.1 * dice_uniform(d) * (double)p[3],
			 dice_direction(d));
}

/* Follows a ray and starts another at each hit. */
static void follow_ray(const struct strand *s, const struct geom_shape *g, const struct accel *a, struct dice *d,
		       double away, size_t *met)
{
	vec3 w = dice_direction(d);
	struct ray_end from = {vec3_madd(direction_to_strand(s, d), -away, w), {0, 0, 0}, PRIM_NONE};
	for (int i = 0; i < 20; i++) {
		struct ray_hit hit;
		struct prim_ref prim;
		struct curve_crossing crossing;
		bool any = accel_closest(a, &from, w, 0, INFINITY, &hit);
		assert_true(any == search_nearest(s, &from, w, INFINITY, &crossing, &prim));
		assert_true((away > 10 && i == 0) || any == accel_occluded_to_infinity(a, &from, w));
		if (!any)
			return;
		assert_true(fabs(hit.t - crossing.t) < 1e-6 * (1 + away));
		struct surface_point x, y;
		surface_from_hit(&g[hit.prim.shape], from.p, w, &hit, &x);
		if (vec3_length(vec3_cross(vec3_sub(x.p, from.p), w)) > 4e-8)
			return; /* the roots of a tangent ray are off by the square root of the rounding */
		/* Nothing lies in front of the hit, and the curve lies behind it. */
		struct ray_end to = body_ray_end(&x), beyond = {vec3_madd(x.p, 1e-4, w), {0, 0, 0}, PRIM_NONE};
		assert_false(accel_occluded(a, &from, &to));
		assert_false(accel_occluded(a, &to, &from));
		assert_true(accel_occluded(a, &from, &beyond));
		assert_true(surface_reproject(&g[hit.prim.shape], hit.prim, from.prim, from.p, w, hit.t, &y));
		assert_true(vec3_length(vec3_sub(x.p, y.p)) < 4e-8);
		assert_true(surface_on_curve(&g[hit.prim.shape], x.prim, x.b1, x.b2, &y));
		assert_memory_equal(&x.p, &y.p, sizeof x.p);
		++*met;
		from = to;
		w = i % 2 ? w : dice_direction(d);
	}
}

static void rays_meet_strands_as_a_search_does(void **state)
{
	(void)state;
	struct dice d = dice_for_test("rays at strands");
	static const double radii[] = {0.02, 1e-3, 2e-5};
	for (size_t i = 0; i < dice_scaled_count(300); i++) {
		struct strand s[STRANDS];
		struct geom_shape g[STRANDS];
		make_strand(s, g, radii[i % 3], &d);
		struct accel *a = body_build_accel(g, STRANDS);
		size_t met = 0;
		for (int k = 0; k < 100; k++)
			follow_ray(s, g, a, &d, k % 3 == 0 ? 0 : k % 3 == 1 ? 2 : 1000, &met);
		assert_true(met > 30);
		accel_free(a);
	}
}

/* Embree lifts rays that run low over a plane. A thin hair along an axis fills its boxes up to their sides; the
 * lifted rays must meet it where the search in double does. */
static void thin_hair_is_met_by_lifted_rays(void **state)
{
	(void)state;
	struct dice d = dice_for_test("hairs over a plane");
	struct strand s;
	struct geom_shape g[2];
	body_make_plane(&g[0], 2, 0, 0);
	strand_init(&s);
	for (int i = 0; i < 5; i++)
		strand_add(&s, (vec3){0.25 * i - 0.5, 0, 0.03125}, 1e-5);
	strand_end_chain(&s);
	g[1] = (struct geom_shape){.curves = &s.curves, .normal_sign = 1};
	struct accel *a = body_build_accel(g, 2);
	size_t met = 0;
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		struct surface_point x = body_sample_point(&g[0], 0, &d);
		if (x.p.y > -0.5)
			continue;
		vec3 to = {dice_between(&d, -0.4, 0.4), 0, 0.03125 + dice_between(&d, -1.2e-5, 1.2e-5)},
		     w = vec3_normalize(vec3_sub(to, x.p));
		struct ray_end from = body_ray_end(&x);
		struct curve_ray r = {.o = x.p, .d = w, .t_max = INFINITY};
		struct curve_crossing crossing;
		struct ray_hit hit;
		bool any = false;
		for (uint32_t k = 0; k < s.curves.count; k++)
			any |= curves_intersect(&s.curves, k, &r, &crossing);
		assert_true(any == accel_closest(a, &from, w, 0, INFINITY, &hit));
		assert_true(any == accel_occluded_to_infinity(a, &from, w));
		met += any;
	}
	assert_true(met > dice_scaled_count(20000) / 10);
	accel_free(a);
	body_fini(&g[0]);
}

/* The frame: dp/du runs around the strand, so that t runs along it; smooth normals are perpendicular to the tangents
 * at the control points, from both sides. */
static void frames_follow_the_strand(void **state)
{
	(void)state;
	struct dice d = dice_for_test("frames of strands");
	for (size_t i = 0; i < dice_scaled_count(2000); i++) {
		struct strand s;
		strand_make_random(&s, 4, 0.3, (const double[]){0.3, 0.4}, (const double[]){0.1, 0.1}, &d);
		struct geom_shape g = {.curves = &s.curves, .normal_sign = 1};
		uint32_t prim = 1 + dice_below(&d, 2);
		double around = dice_between(&d, -M_PI, M_PI);
		struct surface_point x;
		assert_true(surface_on_curve(&g, (struct prim_ref){0, prim, 0}, 0.5, around, &x));
		struct cone c = curves_cone(&s.curves, prim);
		assert_true(vec3_dot(x.sh.t, c.axis) > 1 - 1e-6 && fabs(vec3_dot(x.sh.s, c.axis)) < 1e-7);
		strand_set_tangents(&s, 0.1, &d);
		for (int end = 0; end < 2; end++) {
			assert_true(surface_on_curve(&g, (struct prim_ref){0, prim, 0}, end, around, &x));
			const float *t = s.tangent[prim + (uint32_t)end];
			vec3 along = {(double)t[0], (double)t[1], (double)t[2]};
			assert_true(fabs(vec3_dot(x.sh.n, along)) < 1e-6 && vec3_dot(x.sh.t, along) > 1 - 1e-6);
			assert_true(vec3_dot(x.sh.n, x.ng) > 0.9);
		}
	}
}

enum { HAIRS = 4000, SEGMENTS_PER_HAIR = 25 };

struct hairs {
	struct curves c;
	float point[HAIRS * (SEGMENTS_PER_HAIR + 1)][4], start[HAIRS * SEGMENTS_PER_HAIR],
		v[HAIRS * (SEGMENTS_PER_HAIR + 1)];
	uint32_t cone[HAIRS * SEGMENTS_PER_HAIR];
};

static void make_hairs(struct hairs *h, struct dice *d)
{
	h->c = (struct curves){
		.points = h->point, .cone = h->cone, .u_start = h->start, .v = h->v, .max_radius = 1e-4f};
	for (uint32_t i = 0; i < HAIRS; i++) {
		vec3 p = vec3_scale(0.5, dice_direction(d)), w = vec3_normalize(p);
		for (uint32_t k = 0; k <= SEGMENTS_PER_HAIR; k++) {
			memcpy(h->point[h->c.point_count++], (float[4]){(float)p.x, (float)p.y, (float)p.z, 1e-4f},
			       sizeof h->point[0]);
			w = vec3_normalize(vec3_madd(w, 0.1, dice_direction(d)));
			p = vec3_madd(p, 0.4 / SEGMENTS_PER_HAIR, w);
			if (k < SEGMENTS_PER_HAIR)
				h->cone[h->c.count++] = (i * (SEGMENTS_PER_HAIR + 1) + k) << CURVE_SHIFT |
							(k == 0 ? (uint32_t)CURVE_BEGINS : 0) |
							(k == SEGMENTS_PER_HAIR - 1 ? (uint32_t)CURVE_ENDS : 0);
		}
	}
}

/* The memory per segment, and equal bits from two trees. */
static void hairs_take_bounded_memory_and_give_equal_bits(void **state)
{
	(void)state;
	struct dice d = dice_for_test("many hairs");
	struct hairs *h = mem_alloc(1, sizeof *h);
	assert_non_null(h);
	make_hairs(h, &d);
	struct geom_shape g = {.curves = &h->c, .normal_sign = 1};
	struct accel *a = body_build_accel(&g, 1), *b = body_build_accel(&g, 1);
	double arrays = (double)(sizeof *h - sizeof h->c) / (double)h->c.count,
	       tree = (double)accel_bytes(a) / (double)h->c.count;
	print_message("%u segments: %.1f bytes each, and %.1f in Embree (at most %.1f)\n", h->c.count, arrays, tree,
		      (double)accel_peak_bytes(a) / (double)h->c.count);
	assert_true(arrays + tree <= 150);
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		vec3 w = dice_direction(&d);
		struct ray_end from = {vec3_scale(-2, dice_direction(&d)), {0, 0, 0}, PRIM_NONE};
		w = vec3_normalize(vec3_sub(vec3_scale(0.7, w), from.p));
		struct ray_hit x = {.t = 0}, y = {.t = 0};
		assert_true(accel_closest(a, &from, w, 0, INFINITY, &x) == accel_closest(b, &from, w, 0, INFINITY, &y));
		assert_true(x.t == y.t && x.prim.prim == y.prim.prim && x.u == y.u && x.v == y.v);
	}
	accel_free(a);
	accel_free(b);
	mem_free(h);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rays_meet_strands_as_a_search_does),
		cmocka_unit_test(thin_hair_is_met_by_lifted_rays),
		cmocka_unit_test(frames_follow_the_strand),
		cmocka_unit_test(hairs_take_bounded_memory_and_give_equal_bits),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
