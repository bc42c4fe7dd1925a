/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chains of cones: rays must meet the boundary of the union, found by a search along the axes; rays enter and leave
 * the union alternately, also at joints and from the surface itself; and points must lie where their coordinates say.
 */
#include "tests/support/strands.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static const struct strand_kind {
	const char *name;
	uint32_t count;
	double turn, length[2], radius[2];
} strand_kinds[] = {
	{"straight", 5, 0, {0.3, 0.5}, {0.1, 0.1}},	{"bent", 6, 1, {0.3, 0.5}, {0.05, 0.15}},
	{"hair", 8, 0.2, {0.2, 0.2}, {1e-4, 2e-4}},	{"fat", 8, 0.3, {0.05, 0.1}, {0.3, 0.4}},
	{"corners", 3, 3, {0.4, 0.6}, {0.02, 0.1}},	{"beads", 5, 0.5, {0.2, 0.4}, {0.05, 0.5}},
	{"smooth", 20, 0.05, {0.05, 0.05}, {0.1, 0.1}},
};
enum { KINDS = sizeof strand_kinds / sizeof *strand_kinds };

static void make_strand(struct strand *s, const struct strand_kind *k, struct dice *d)
{
	strand_make_random(s, k->count, k->turn, k->length, k->radius, d);
}

/* Finds the nearest primitive that the ray meets; returns false if there is none. */
static bool find_nearest_prim(const struct strand *s, struct curve_ray *r, uint32_t *prim, struct curve_crossing *x)
{
	bool any = false;
	double t_max = r->t_max;
	for (uint32_t i = 0; i < s->curves.count; i++)
		if (curves_intersect(&s->curves, i, r, x)) {
			*prim = i;
			r->t_max = x->t;
			any = true;
		}
	r->t_max = t_max;
	return any;
}

static vec3 point_near_strand(const struct strand *s, struct dice *d)
{
	const float *p = s->point[dice_below(d, s->curves.point_count)];
	double off = dice_below(d, 2) ? 1 : dice_between(d, 0, 1.2);
	return vec3_madd((vec3){(double)p[0], (double)p[1], (double)p[2]}, off * (double)p[3], dice_direction(d));
}

/* A ray from outside goes on through the chain until it has no hit: it enters and leaves alternately, and the
 * distance is 0 at each crossing. A crossing that is missed, or met twice, breaks the alternation. */
static void rays_enter_and_leave_a_chain_alternately(void **state)
{
	(void)state;
	struct dice d = dice_for_test("crossings of strands");
	for (size_t i = 0; i < dice_scaled_count(28000); i++) {
		const struct strand_kind *k = &strand_kinds[i % KINDS];
		struct strand s;
		make_strand(&s, k, &d);
		vec3 w = dice_direction(&d), o = vec3_madd(point_near_strand(&s, &d), -20, w);
		struct curve_ray r = {.o = o, .d = w, .t_max = INFINITY};
		int depth = 0, met = 0;
		uint32_t prim;
		struct curve_crossing x;
		while (find_nearest_prim(&s, &r, &prim, &x)) {
			struct cone c = curves_cone(&s.curves, prim);
			struct curve_coordinates at = curves_coordinates(&c, x.part, vec3_madd(r.o, x.t, w));
			struct curve_point p;
			assert_true(curves_have_point(&s.curves, prim, at));
			curves_compute_point(&s.curves, prim, at, &p);
			double surface_distance = strand_distance(&s, p.p),
			       beside = vec3_length(vec3_cross(vec3_sub(p.p, o), w));
			if (!(fabs(surface_distance) < 1e-9 && beside < 2e-7))
				fail_msg("%s, ray %zu: distance %g, %g beside the ray", k->name, i, surface_distance,
					 beside);
			depth += vec3_dot(p.n, w) < 0 ? 1 : -1;
			if (depth < 0 || depth > 1)
				fail_msg("%s, ray %zu: crossing %d makes it %d deep", k->name, i, met, depth);
			r = (struct curve_ray){
				.o = p.p, .d = w, .t_max = INFINITY, .starts_on_curve = true, .start_prim = prim};
			assert_true(++met < 100);
		}
		if (depth != 0)
			fail_msg("%s, ray %zu: it ends inside", k->name, i);
		if (met == 0) { /* the ray misses the chain */
			double min_distance = INFINITY;
			for (int j = -200; j <= 200; j++)
				min_distance = fmin(min_distance, strand_distance(&s, vec3_madd(o, 20 + 0.01 * j, w)));
			assert_true(min_distance > -1e-9);
		}
	}
}

/* Rays meet a culled chain where they enter it and nowhere else: at every second crossing of the same chain without
 * culling. */
static void culled_chain_is_met_only_where_rays_enter(void **state)
{
	(void)state;
	struct dice d = dice_for_test("culled strands");
	size_t entered = 0;
	for (size_t i = 0; i < dice_scaled_count(14000); i++) {
		const struct strand_kind *k = &strand_kinds[i % KINDS];
		struct strand s;
		make_strand(&s, k, &d);
		vec3 w = dice_direction(&d);
		struct curve_ray r = {.o = vec3_madd(point_near_strand(&s, &d), -20, w), .d = w, .t_max = INFINITY},
				 culled = r;
		culled.culls_backfaces = true;
		uint32_t prim, culled_prim;
		struct curve_crossing x, y;
		while (find_nearest_prim(&s, &r, &prim, &x)) {
			struct cone c = curves_cone(&s.curves, prim);
			struct curve_point p;
			curves_compute_point(&s.curves, prim, curves_coordinates(&c, x.part, vec3_madd(r.o, x.t, w)),
					     &p);
			if (vec3_dot(p.n, w) < 0) {
				if (!(find_nearest_prim(&s, &culled, &culled_prim, &y) && culled_prim == prim &&
				      y.part == x.part))
					fail_msg("%s, ray %zu: the chain is not entered", k->name, i);
				culled = (struct curve_ray){.o = p.p,
							    .d = w,
							    .t_max = INFINITY,
							    .starts_on_curve = true,
							    .start_prim = prim,
							    .culls_backfaces = true};
				entered++;
			}
			r = (struct curve_ray){
				.o = p.p, .d = w, .t_max = INFINITY, .starts_on_curve = true, .start_prim = prim};
		}
		if (find_nearest_prim(&s, &culled, &culled_prim, &y))
			fail_msg("%s, ray %zu: it is met from inside", k->name, i);
	}
	assert_true(entered > dice_scaled_count(7000));
}

/* A segment between two points of the surface meets nothing at its ends. */
static void segments_meet_nothing_at_their_ends(void **state)
{
	(void)state;
	struct dice d = dice_for_test("segments of strands");
	size_t inner = 0;
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		struct strand s;
		make_strand(&s, &strand_kinds[i % 2], &d); /* straight and bent in turn */
		vec3 w = dice_direction(&d);
		struct curve_ray r = {.o = vec3_madd(point_near_strand(&s, &d), -20, w), .d = w, .t_max = INFINITY};
		uint32_t first, second, between;
		struct curve_crossing x, y;
		struct curve_point a, b;
		if (!find_nearest_prim(&s, &r, &first, &x))
			continue;
		struct cone c = curves_cone(&s.curves, first);
		curves_compute_point(&s.curves, first, curves_coordinates(&c, x.part, vec3_madd(r.o, x.t, w)), &a);
		r = (struct curve_ray){
			.o = a.p, .d = w, .t_max = INFINITY, .starts_on_curve = true, .start_prim = first};
		assert_true(find_nearest_prim(&s, &r, &second, &y));
		c = curves_cone(&s.curves, second);
		curves_compute_point(&s.curves, second, curves_coordinates(&c, y.part, vec3_madd(r.o, y.t, w)), &b);
		r = (struct curve_ray){.o = a.p,
				       .d = vec3_sub(b.p, a.p),
				       .end = b.p,
				       .starts_on_curve = true,
				       .ends_on_curve = true,
				       .start_prim = first,
				       .end_prim = second,
				       .t_max = 1};
		for (between = 0; between < s.curves.count; between++)
			assert_false(curves_intersect(&s.curves, between, &r, &x));
		r = (struct curve_ray){.o = b.p,
				       .d = vec3_sub(a.p, b.p),
				       .end = a.p,
				       .starts_on_curve = true,
				       .ends_on_curve = true,
				       .start_prim = second,
				       .end_prim = first,
				       .t_max = 1};
		for (between = 0; between < s.curves.count; between++)
			assert_false(curves_intersect(&s.curves, between, &r, &x));
		inner++;
	}
	assert_true(inner > dice_scaled_count(20000) / 4);
}

/* From points so near a joint that in double they lie on two cones: outwards, a ray does not meet a straight chain
 * again; inwards, it meets the chain once. The axis is straight in float as well; with one radius, and tapered. */
static void rays_from_joints_meet_no_neighbour(void **state)
{
	(void)state;
	struct dice d = dice_for_test("joints of strands");
	for (size_t i = 0; i < dice_scaled_count(40000); i++) {
		struct strand s;
		strand_init(&s);
		for (int k = 0; k < 5; k++)
			strand_add(&s, (vec3){0.5 * k - 1, 0.375, 0.125}, i % 2 ? 0.25 : 0.5 - 0.0625 * k);
		strand_end_chain(&s);
		uint32_t from = 1 + dice_below(&d, 2), prim;
		double offset = exp(dice_between(&d, log(1e-17), log(1e-3)));
		struct curve_point p;
		curves_compute_point(
			&s.curves, from,
			(struct curve_coordinates){i / 2 % 2 ? offset : 1 - offset, dice_between(&d, -3, 3)}, &p);
		vec3 w = dice_direction(&d);
		struct curve_ray r = {.o = p.p, .d = w, .t_max = INFINITY, .starts_on_curve = true, .start_prim = from};
		struct curve_crossing x;
		bool any = find_nearest_prim(&s, &r, &prim, &x);
		if (fabs(vec3_dot(w, p.n)) < 1e-6)
			continue;
		if (any != (vec3_dot(w, p.n) < 0) || (any && !(x.t > 0.1 * fabs(vec3_dot(w, p.n)))))
			fail_msg("ray %zu, %g from a joint: %smet, at %g", i, offset, any ? "" : "not ", any ? x.t : 0);
	}
}

/* Open ends: a ray along the axis of a straight chain meets nothing, and a ray from the side meets two walls. */
static void open_ends_have_no_caps(void **state)
{
	(void)state;
	struct strand s;
	strand_init(&s);
	for (int i = 0; i < 4; i++)
		strand_add(&s, (vec3){i, 0, 0}, 0.25);
	strand_end_chain(&s);
	for (int open = 0; open < 2; open++) {
		s.curves.is_open = open;
		struct curve_ray along = {.o = {-2, 0.1, 0}, .d = {1, 0, 0}, .t_max = INFINITY},
				 across = {.o = {1, 0.1, -2}, .d = {0, 0, 1}, .t_max = INFINITY},
				 cap = {.o = {-0.1, 0.1, -2}, .d = {0, 0, 1}, .t_max = INFINITY};
		uint32_t prim;
		struct curve_crossing x;
		assert_true(find_nearest_prim(&s, &along, &prim, &x) == !open &&
			    find_nearest_prim(&s, &across, &prim, &x));
		assert_true(find_nearest_prim(&s, &cap, &prim, &x) == !open);
	}
}

/* Coordinates: the nearest point of the chain to a surface point is that point; tangents are those of differences; v
 * interpolates that of the control points, and u goes around once. */
static void coordinates_lead_back_to_their_point(void **state)
{
	(void)state;
	struct dice d = dice_for_test("places on strands");
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		struct strand s;
		make_strand(&s, &strand_kinds[1], &d);
		uint32_t prim = dice_below(&d, s.curves.count);
		struct curve_coordinates at = {dice_between(&d, 0, 1), dice_between(&d, -M_PI, M_PI)};
		struct curve_point p, q;
		curves_compute_point(&s.curves, prim, at, &p);
		struct curve_coordinates reprojected =
			curves_nearest_coordinates(&s.curves, prim, vec3_madd(p.p, 0.01, p.n));
		assert_true(fabs(reprojected.along - at.along) < 1e-12 && fabs(reprojected.around - at.around) < 1e-12);
		double h = 1e-6;
		curves_compute_point(&s.curves, prim,
				     (struct curve_coordinates){at.along + (at.along < 0.5 ? h : -h), at.around}, &q);
		vec3 up = vec3_normalize(vec3_scale(at.along < 0.5 ? 1 : -1, vec3_sub(q.p, p.p)));
		assert_true(vec3_length(vec3_sub(up, p.up)) < 1e-8 && fabs(vec3_dot(p.up, p.n)) < 1e-14);
		curves_compute_point(&s.curves, prim, (struct curve_coordinates){at.along, at.around + h}, &q);
		vec3 side = vec3_scale(1 / (h * p.axis_distance), vec3_sub(q.p, p.p));
		assert_true(vec3_length(vec3_sub(side, p.side)) < 1e-5);
		double turn = q.u - p.u;
		assert_true(fabs((turn < 0 ? turn + 1 : turn) - h / (2 * M_PI)) < 1e-12);
		assert_true(fabs(p.v - (prim + at.along) / 8) < 1e-7);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rays_enter_and_leave_a_chain_alternately),
		cmocka_unit_test(segments_meet_nothing_at_their_ends),
		cmocka_unit_test(culled_chain_is_met_only_where_rays_enter),
		cmocka_unit_test(rays_from_joints_meet_no_neighbour),
		cmocka_unit_test(open_ends_have_no_caps),
		cmocka_unit_test(coordinates_lead_back_to_their_point),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
