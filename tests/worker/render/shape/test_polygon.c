/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Triangulated polygons are compared with an independent test of the inside (the even-odd rule): random points are in
 * exactly one triangle if they are in the polygon, and in none otherwise. For outlines that cross themselves, only the
 * number of triangles is checked.
 */
#include "tests/support/dice.h"
#include "worker/render/math/frame.h"
#include "worker/render/shape/polygon.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <string.h>

#include <cmocka.h>

struct outline {
	uint32_t corner_count;
	double x[POLYGON_CORNERS_MAX], y[POLYGON_CORNERS_MAX];
};

static bool is_inside(const struct outline *o, double x, double y)
{
	bool inside = false;
	for (uint32_t i = 0, j = o->corner_count - 1; i < o->corner_count; j = i++)
		if ((o->y[i] > y) != (o->y[j] > y) &&
		    x < (o->x[j] - o->x[i]) * (y - o->y[i]) / (o->y[j] - o->y[i]) + o->x[i])
			inside = !inside;
	return inside;
}

static double side_of_line(const struct outline *o, uint32_t a, uint32_t b, double x, double y)
{
	return (o->x[b] - o->x[a]) * (y - o->y[a]) - (o->y[b] - o->y[a]) * (x - o->x[a]);
}

/* Checks the polygon in a plane across n, away from the origin. Each triangle has the orientation of the polygon, 1 or
 * -1. */
static void check_triangulation(const char *what, const struct outline *o, vec3 n, int orientation)
{
	static struct polygon p;
	static uint32_t t[POLYGON_CORNERS_MAX][3];
	struct frame f = frame_around(vec3_normalize(n));
	struct dice d = dice_for_test(what);
	p.corner_count = o->corner_count;
	for (uint32_t i = 0; i < o->corner_count; i++)
		p.corner[i] = frame_to_world(&f, (vec3){o->x[i] + 10, o->y[i] - 20, 5});
	memset(t, 0xff, sizeof t);
	polygon_triangulate(&p, t);
	uint32_t used[POLYGON_CORNERS_MAX] = {0};
	for (uint32_t i = 0; i < o->corner_count - 2; i++)
		for (int k = 0; k < 3; k++) {
			assert_true(t[i][k] < o->corner_count);
			used[t[i][k]]++;
		}
	for (uint32_t i = 0; i < o->corner_count; i++)
		assert_true(used[i] > 0);
	assert_true(t[o->corner_count - 2][0] == UINT32_MAX);
	unsigned hits = 0;
	for (int k = 0; k < 2000; k++) {
		double x = 2.4 * dice_uniform(&d) - 1.2, y = 2.4 * dice_uniform(&d) - 1.2;
		unsigned count = 0;
		for (uint32_t i = 0; i < o->corner_count - 2; i++) {
			double a = orientation * side_of_line(o, t[i][0], t[i][1], x, y),
			       b = orientation * side_of_line(o, t[i][1], t[i][2], x, y),
			       c = orientation * side_of_line(o, t[i][2], t[i][0], x, y);
			count += a > 0 && b > 0 && c > 0;
		}
		if (count != (is_inside(o, x, y) ? 1 : 0))
			fail_msg("%s: (%g, %g) is in %u triangles", what, x, y, count);
		hits += count;
	}
	assert_true(hits > 20);
}

static void check_both_orientations(const char *what, struct outline *o)
{
	static const vec3 normals[] = {{0, 0, 1},      {0, 0, -1},    {1, 0.2, 0.1},
				       {-1, 0.3, 0.5}, {0.2, 1, 0.6}, {0.3, -1, 0.6}};
	struct outline back = {.corner_count = o->corner_count};
	for (uint32_t i = 0; i < o->corner_count; i++) {
		back.x[i] = o->x[o->corner_count - 1 - i];
		back.y[i] = o->y[o->corner_count - 1 - i];
	}
	for (size_t i = 0; i < sizeof normals / sizeof normals[0]; i++) {
		check_triangulation(what, o, normals[i], 1);
		check_triangulation(what, &back, normals[i], -1);
	}
}

/* Corners around a centre, with random radii: few of these polygons are convex. */
static void test_random_polygons_are_triangulated(void **state)
{
	(void)state;
	struct dice d = dice_for_test("polygon");
	for (uint32_t n = 4; n < 60; n += n < 12 ? 1 : 7) {
		struct outline o = {.corner_count = n};
		for (uint32_t i = 0; i < n; i++) {
			double r = 0.1 + dice_uniform(&d), phi = 2 * M_PI * i / n;
			o.x[i] = r * cos(phi);
			o.y[i] = r * sin(phi);
		}
		check_both_orientations("random", &o);
	}
}

/* A band along a spiral: no corner sees all others, and most corners are no ears. */
static void test_spiral_is_triangulated(void **state)
{
	(void)state;
	for (uint32_t n = 40; n <= POLYGON_CORNERS_MAX; n = n < 500 ? 4 * n : n + 384) {
		struct outline o = {.corner_count = n};
		for (uint32_t i = 0; i < n; i++) {
			uint32_t k = i < n / 2 ? i : n - 1 - i;
			double phi = 6 * M_PI * k / (n / 2.0), r = (i < n / 2 ? 0.2 : 0.15) + 0.04 * phi;
			o.x[i] = r * cos(phi);
			o.y[i] = r * sin(phi);
		}
		check_both_orientations("spiral", &o);
	}
}

/* A square with a square hole, to and from which the outline runs along one line; and corners on straight lines. */
static void test_outline_with_a_hole_is_triangulated(void **state)
{
	(void)state;
	struct outline o = {.corner_count = 12,
			    .x = {-1, 0, 1, 1, -1, -1, -0.5, 0.5, 0.5, -0.5, -0.5, -1},
			    .y = {-1, -1, -1, 1, 1, 0.5, 0.5, 0.5, -0.5, -0.5, 0.5, 0.5}};
	for (int k = 0; k < 2; k++) {
		struct outline turned = {.corner_count = o.corner_count};
		for (uint32_t i = 0; i < o.corner_count; i++) {
			turned.x[i] = o.x[(i + 7 * (uint32_t)k) % o.corner_count];
			turned.y[i] = o.y[(i + 7 * (uint32_t)k) % o.corner_count];
		}
		/* Counter-clockwise outside, clockwise around the hole. */
		check_triangulation("hole", &turned, (vec3){0.3, 0.2, 1}, 1);
	}
}

/* Convex polygons, and those that a fan covers, keep the fan; so do those without area. */
static void test_convex_polygons_keep_the_fan(void **state)
{
	(void)state;
	static const struct polygon fans[] = {{4, {{0, 0, 0}, {1, 0, 0.1}, {1, 1, 0}, {0, 1, 0.1}}},
					      {4, {{0, 0.5, 0}, {-1, -1, 0}, {0, 1, 0}, {1, -1, 0}}},
					      {5, {{1, 1, 1}}},
					      {3, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}};
	for (int i = 0; i < 4; i++) {
		uint32_t t[3][3] = {{9}};
		polygon_triangulate(&fans[i], t);
		for (uint32_t k = 0; k < fans[i].corner_count - 2; k++)
			assert_true(t[k][0] == 0 && t[k][1] == k + 1 && t[k][2] == k + 2);
	}
}

/* Outlines of all sizes that cross themselves at random give n - 2 triangles with valid corners. */
static void test_crossed_outlines_give_valid_corners(void **state)
{
	(void)state;
	static struct polygon p;
	static uint32_t t[POLYGON_CORNERS_MAX][3];
	struct dice d = dice_for_test("crossed");
	for (uint32_t n = 3; n <= POLYGON_CORNERS_MAX; n += 1 + n / 3) {
		for (p.corner_count = 0; p.corner_count < n; p.corner_count++)
			p.corner[p.corner_count] = (vec3){dice_uniform(&d), dice_uniform(&d), dice_below(&d, 2)};
		memset(t, 0xff, sizeof t);
		polygon_triangulate(&p, t);
		for (uint32_t i = 0; i < n - 2; i++)
			assert_true(t[i][0] < n && t[i][1] < n && t[i][2] < n);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_random_polygons_are_triangulated),
		cmocka_unit_test(test_spiral_is_triangulated),
		cmocka_unit_test(test_outline_with_a_hole_is_triangulated),
		cmocka_unit_test(test_convex_polygons_keep_the_fan),
		cmocka_unit_test(test_crossed_outlines_give_valid_corners),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
