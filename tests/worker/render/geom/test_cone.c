/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Round cones: distances against a search along the axis, rays against the sign of this distance, areas against
 * closed forms; and rays that start on the surface.
 */
#include "tests/support/strands.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static const struct cone_kind {
	const char *name;
	double length, r0, r1;
} cone_kinds[] = {
	{"cylinder", 1, 0.3, 0.3},
	{"cone", 1, 0.5, 0.2},
	{"wider", 1, 0.1, 0.4},
	{"tip", 1, 0.3, 0},
	{"thin", 1, 1e-4, 1e-4},
	{"thin tip", 1, 2e-4, 0},
	{"almost within", 0.3, 0.5, 0.2000001},
	{"first contains", 0.2, 0.5, 0.1},
	{"second contains", 0.2, 0.1, 0.5},
	{"one point", 0, 0.4, 0.4},
	{"one center", 0, 0.1, 0.3},
	{"short", 1e-6, 0.5, 0.5},
};
enum { KINDS = sizeof cone_kinds / sizeof *cone_kinds };

static struct cone cone_of(const struct cone_kind *k, vec3 *p0, vec3 *p1, struct dice *d)
{
	*p0 = vec3_scale(0.5, dice_direction(d));
	*p1 = vec3_madd(*p0, k->length, dice_direction(d));
	return cone_between(*p0, k->r0, *p1, k->r1);
}

/* Returns the distance to the unrounded cone, found by a search along the axis. */
static double distance_by_search(vec3 p0, double r0, vec3 p1, double r1, vec3 p)
{
	double low = 0, high = 1;
	vec3 way = vec3_sub(p1, p0);
	for (int i = 0; i < 120; i++) {
		double x = low + (high - low) / 3, y = high - (high - low) / 3;
		double f = vec3_length(vec3_sub(p, vec3_madd(p0, x, way))) - r0 - x * (r1 - r0),
		       g = vec3_length(vec3_sub(p, vec3_madd(p0, y, way))) - r0 - y * (r1 - r0);
		if (f <= g)
			high = y;
		else
			low = x;
	}
	return vec3_length(vec3_sub(p, vec3_madd(p0, low, way))) - r0 - low * (r1 - r0);
}

static void distance_agrees_with_a_search(void **state)
{
	(void)state;
	struct dice d = dice_for_test("distances from cones");
	for (size_t i = 0; i < dice_scaled_count(20000); i++) {
		const struct cone_kind *k = &cone_kinds[i % KINDS];
		vec3 p0, p1;
		struct cone c = cone_of(k, &p0, &p1, &d);
		vec3 p = vec3_madd(p0, dice_between(&d, 0, 2) * (k->r0 + k->r1 + k->length), dice_direction(&d));
		double expected = distance_by_search(p0, k->r0, p1, k->r1, p),
		       actual = cone_distance(&c, p, false, false);
		if (!(fabs(actual - expected) <= 1e-12))
			fail_msg("%s: a distance of %.17g, not %.17g", k->name, actual, expected);
	}
}

/* Stores all roots that lie on their own parts of the cone, sorted; returns their number. */
static int roots_of(const struct cone *c, vec3 o, vec3 d, double slack, double t[6])
{
	int n = 0;
	for (enum cone_part part = 0; part < CONE_PARTS; part++) {
		double root[2];
		for (int k = 0; cone_roots(c, part, o, d, root) && k < 2; k++)
			if (isfinite(root[k]) && cone_part_contains(c, part, vec3_madd(o, root[k], d), slack))
				t[n++] = root[k];
	}
	for (int i = 0; i < n; i++)
		for (int j = i + 1; j < n; j++)
			if (t[j] < t[i]) {
				double swap = t[i];
				t[i] = t[j];
				t[j] = swap;
			}
	return n;
}

/* A line meets the convex body twice or not at all: at both hits the distance is 0, between them it is negative, and
 * on a line without hits it is negative nowhere. Rays from near and far, in all directions, towards the axis and past
 * it. */
static void rays_meet_a_cone_twice_or_not_at_all(void **state)
{
	(void)state;
	struct dice dice = dice_for_test("rays at cones");
	uint32_t hits[KINDS] = {0};
	for (size_t i = 0; i < dice_scaled_count(60000); i++) {
		const struct cone_kind *k = &cone_kinds[i % KINDS];
		vec3 p0, p1;
		struct cone c = cone_of(k, &p0, &p1, &dice);
		double wide = fmax(k->r0, k->r1), away = i % 3 ? 2 : 1000;
		vec3 to = vec3_madd(vec3_madd(p0, dice_between(&dice, -0.1, 1.1), vec3_sub(p1, p0)),
				    dice_between(&dice, 0, 1.3) * wide, dice_direction(&dice));
		vec3 w = i % 5 ? dice_direction(&dice) : c.axis, o = vec3_madd(to, -away, w);
		double t[6], tolerance = 1e-13 * away;
		int n = roots_of(&c, o, w, 1e-14, t);
		for (int j = 0; j < n; j++) {
			double surface_distance = cone_distance(&c, vec3_madd(o, t[j], w), false, false);
			if (!(fabs(surface_distance) <= tolerance))
				fail_msg("%s: root %.17g is off by %g", k->name, t[j], surface_distance);
		}
		double min_distance = INFINITY; /* smallest distance on the line */
		double low = away - 3, high = away + 3;
		for (int j = 0; j < 200; j++) {
			double x = low + (high - low) / 3, y = high - (high - low) / 3;
			double f = cone_distance(&c, vec3_madd(o, x, w), false, false),
			       g = cone_distance(&c, vec3_madd(o, y, w), false, false);
			min_distance = fmin(min_distance, fmin(f, g));
			if (f <= g)
				high = y;
			else
				low = x;
		}
		if (min_distance < -1e-11 && !(n >= 2 && t[0] < low + 1e-9 && t[n - 1] > low - 1e-9))
			fail_msg("%s: goes %g deep, %d roots", k->name, -min_distance, n);
		if (min_distance > 1e-11 && n > 0)
			fail_msg("%s: passes at %g, %d roots", k->name, min_distance, n);
		hits[i % KINDS] += n > 0;
	}
	for (size_t i = 0; i < KINDS; i++)
		assert_true(hits[i] > 100 * dice_scaled_count(60000) / 60000);
}

/* The other root of a line that starts on the surface, against all roots. Outwards, no root lies ahead. */
static void other_root_is_the_far_end_of_the_chord(void **state)
{
	(void)state;
	struct dice dice = dice_for_test("rays from cones");
	for (size_t i = 0; i < dice_scaled_count(30000); i++) {
		const struct cone_kind *k = &cone_kinds[i % KINDS];
		vec3 p0, p1;
		struct cone c = cone_of(k, &p0, &p1, &dice);
		vec3 w = dice_direction(&dice), o = vec3_madd(vec3_madd(p0, 0.5, vec3_sub(p1, p0)), -3, w);
		for (enum cone_part part = 0; part < CONE_PARTS; part++) {
			double root[2];
			if (!cone_roots(&c, part, o, w, root) || !(fabs(root[0]) < 100) || !(fabs(root[1]) < 100))
				continue;
			vec3 p = vec3_madd(o, root[0], w);
			double other = cone_other_root(&c, part, p, w), expected = root[1] - root[0];
			double scale = fmax(k->r0, k->r1) / fmax(expected, 1e-300);
			if (!(fabs(other - expected) <= 1e-9 * expected * fmax(scale, 1)))
				fail_msg("%s, part %d: %.17g, not %.17g", k->name, part, other, expected);
			if (cone_part_contains(&c, part, p, 0))
				assert_true(other > 0 && fabs(cone_height(&c, part, p)) < 1e-13);
		}
	}
}

/* Lines of all directions through a ball of radius R meet a convex body of surface S with probability S / (4 pi R^2)
 * (Cauchy); N = 200000 lines, so that a deviation of 5 standard errors has a level below 1e-6, and one of 2 % of S, at
 * a probability above 0.1, is found with a power above 0.99. */
static void areas_agree_with_crossings_of_random_lines(void **state)
{
	(void)state;
	static const struct cone_kind bodies[] = {{"cylinder with ends", 1, 0.3, 0.3},
						  {"cone", 1, 0.5, 0.2},
						  {"tip", 1, 0.4, 0},
						  {"sphere", 0.2, 0.5, 0.1}};
	struct dice dice = dice_for_test("areas of cones");
	for (size_t b = 0; b < sizeof bodies / sizeof *bodies; b++) {
		const struct cone_kind *k = &bodies[b];
		vec3 p0 = {-0.5 * k->length, 0, 0}, p1 = {0.5 * k->length, 0, 0};
		struct cone c = cone_between(p0, k->r0, p1, k->r1);
		double s = fmin((k->r0 - k->r1) / k->length, 1),
		       side = sqrt(k->length * k->length - pow(k->r0 - k->r1, 2) * (s < 1)), cosine = sqrt(1 - s * s),
		       r = 1.1;
		double area = 2 * M_PI * (k->r0 * k->r0 * (1 + s) + k->r1 * k->r1 * (1 - s)) +
			      (s < 1 ? M_PI * side * cosine * (k->r0 + k->r1) : 0);
		size_t n = 200000, met = 0;
		for (size_t i = 0; i < n; i++) {
			vec3 w = dice_direction(&dice), a = dice_direction(&dice), across;
			across = vec3_normalize(vec3_madd(a, -vec3_dot(a, w), w));
			vec3 o = vec3_madd(vec3_scale(-3, w), r * sqrt(dice_uniform(&dice)), across);
			double t[6];
			met += roots_of(&c, o, w, 1e-14, t) > 0;
		}
		double p = area / (4 * M_PI * r * r), have = (double)met / (double)n;
		print_message("%s: %.4f of %.4f\n", k->name, have / p, 1.0);
		if (!(fabs(have - p) <= 5 * sqrt(p * (1 - p) / (double)n)))
			fail_msg("%s: %g lines of all, not %g", k->name, have, p);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(distance_agrees_with_a_search),
		cmocka_unit_test(rays_meet_a_cone_twice_or_not_at_all),
		cmocka_unit_test(other_root_is_the_far_end_of_the_chord),
		cmocka_unit_test(areas_agree_with_crossings_of_random_lines),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
