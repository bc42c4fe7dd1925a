/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Coinciding surfaces. Pairs of triangles: against their separating axes along the edges, in planes of any direction,
 * near the origin and far from it, with vertices rounded to float. The search: against all pairs. Rays and segments:
 * against the rule that says which of two coinciding surfaces exists.
 */
#include "tests/support/bodies.h"
#include "tests/support/failing_memory.h"
#include "worker/render/geom/coincide.h"
#include "worker/render/geom/coincide_find.h"

#include "common/base/mem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { TRIANGLES_MAX = 4096 };

/* A list of triangles without shared vertices. */
struct triangle_soup {
	float position[3 * TRIANGLES_MAX + 2][3];
	uint32_t index[TRIANGLES_MAX][3];
	uint32_t count;
};

static void add_triangle(struct triangle_soup *s, vec3 a, vec3 b, vec3 c)
{
	const vec3 v[3] = {a, b, c};
	assert_true(s->count < TRIANGLES_MAX);
	for (int k = 0; k < 3; k++) {
		uint32_t i = 3 * s->count + (uint32_t)k;
		s->position[i][0] = (float)v[k].x;
		s->position[i][1] = (float)v[k].y;
		s->position[i][2] = (float)v[k].z;
		s->index[s->count][k] = i;
	}
	s->count++;
}

static struct accel_shape shape_of(const struct triangle_soup *s, enum surface_rank rank)
{
	return (struct accel_shape){.vertex_count = 3 * s->count,
				    .triangle_count = s->count,
				    .position = (const float(*)[3])s->position,
				    .index = (const uint32_t(*)[3])s->index,
				    .rank = rank};
}

static struct triangle triangle_at(const struct triangle_soup *s, uint32_t i)
{
	return triangle_from((const float(*)[3])s->position, s->index[i]);
}

/* ---- two triangles ---- */

/* Draws corners within the square [-1,1]^2 of the plane; slivers are drawn again. */
static void draw_corners(struct dice *d, double c[3][2])
{
	double area;
	do {
		for (int i = 0; i < 3; i++)
			for (int k = 0; k < 2; k++)
				c[i][k] = dice_between(d, -1, 1);
		area = (c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0]);
	} while (fabs(area) < 0.1);
}

/* Returns the widest gap (above 0) along the normals of all edges or, if there is none, the smallest overlap (below
 * 0). */
static double widest_gap(const double a[3][2], const double b[3][2])
{
	double widest = -INFINITY;
	for (int side = 0; side < 6; side++) {
		const double(*t)[2] = side < 3 ? a : b;
		const double *p = t[side % 3], *q = t[(side + 1) % 3];
		double x = q[1] - p[1], y = p[0] - q[0], l = hypot(x, y);
		double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
		for (int i = 0; i < 3; i++) {
			double u = (x * a[i][0] + y * a[i][1]) / l, v = (x * b[i][0] + y * b[i][1]) / l;
			low[0] = fmin(low[0], u), high[0] = fmax(high[0], u);
			low[1] = fmin(low[1], v), high[1] = fmax(high[1], v);
		}
		widest = fmax(widest, fmax(low[0] - high[1], low[1] - high[0]));
	}
	return widest;
}

static void add_triangle_in_plane(struct triangle_soup *s, const struct frame *f, vec3 origin, double size,
				  const double c[3][2])
{
	vec3 v[3];
	for (int i = 0; i < 3; i++)
		v[i] = vec3_madd(vec3_madd(origin, size * c[i][0], f->s), size * c[i][1], f->t);
	add_triangle(s, v[0], v[1], v[2]);
}

static bool do_coincide(const struct triangle *a, const struct triangle *b)
{
	bool unused, forward = coincide_triangles(a, b, 0, &unused), reverse = coincide_triangles(b, a, 0, &unused);
	if (forward != reverse)
		fail_msg("one coincides with the other, which does not with the one");
	return forward;
}

static void two_triangles_coincide_if_they_overlap_in_one_plane(void **state)
{
	(void)state;
	static struct triangle_soup s;
	struct dice d = dice_for_test("two triangles");
	size_t seen[2] = {0, 0};
	for (size_t n = dice_scaled_count(100000); n > 0; n--) {
		double a[3][2], b[3][2], size = exp2(dice_between(&d, -12, -1));
		struct frame f = frame_around(dice_direction(&d));
		vec3 plane_origin = vec3_scale(dice_uniform(&d) < 0.5 ? 0.5 : 0, dice_direction(&d));
		draw_corners(&d, a);
		draw_corners(&d, b);
		double g = widest_gap(a, b);
		if (fabs(g) < 0x1p-6)
			continue;
		s.count = 0;
		add_triangle_in_plane(&s, &f, plane_origin, size, a);
		add_triangle_in_plane(&s, &f, plane_origin, size, b);
		/* Farther apart than the rounding of the vertices (coordinates are below 2); and a tilted copy. */
		vec3 shifted_origin = vec3_madd(plane_origin, dice_uniform(&d) < 0.5 ? 0x1p-20 : -0x1p-18, f.n);
		add_triangle_in_plane(&s, &f, shifted_origin, size, b);
		struct frame tilted = frame_around(vec3_normalize(vec3_madd(f.n, 0.02, f.s)));
		add_triangle_in_plane(&s, &tilted, plane_origin, fmax(size, 0x1p-10), b);
		const struct triangle t[4] = {triangle_at(&s, 0), triangle_at(&s, 1), triangle_at(&s, 2),
					      triangle_at(&s, 3)};
		if (do_coincide(&t[0], &t[1]) != (g < 0))
			fail_msg("a gap of %g, in triangles of %g: %s", g, size,
				 g < 0 ? "not seen to overlap" : "seen to overlap");
		if (do_coincide(&t[0], &t[2]))
			fail_msg("triangles of %g apart by 2^-20 or more are taken for one", size);
		if (size >= 0x1p-10 && do_coincide(&t[0], &t[3]))
			fail_msg("triangles of %g at an angle of 0.02 are taken for one", size);
		seen[g < 0]++;
	}
	assert_true(seen[0] > 0 && seen[1] > 0);
}

/* Neighbours that share an edge or a corner, in one plane or not, never coincide: tested on a plane and a ball. */
static void neighbours_never_coincide(void **state)
{
	(void)state;
	struct geom_shape g[2];
	body_make_plane(&g[0], 8, 0.3, 0.7);
	body_make_ball(&g[1], 8, 0.7, 0.1);
	for (int k = 0; k < 2; k++) {
		for (uint32_t i = 0; i < g[k].triangle_count; i++)
			for (uint32_t j = 0; j < i; j++) {
				const struct triangle a =
					triangle_from((const float(*)[3])g[k].position, g[k].index[i]);
				const struct triangle b =
					triangle_from((const float(*)[3])g[k].position, g[k].index[j]);
				assert_false(do_coincide(&a, &b));
			}
		body_fini(&g[k]);
	}
}

/* ---- the search ---- */

/* Returns the primitive that exists at p by the rule: the first, in order of rank, of all primitives that overlap
 * this one or are hidden by one that does. */
static struct prim_ref present_prim_by_rule(const struct accel_shape *s, uint32_t count, struct prim_ref at, vec3 p)
{
	const struct triangle t = triangle_from(s[at.shape].position, s[at.shape].index[at.prim]);
	for (unsigned rank = 0; rank <= s[at.shape].rank; rank++)
		for (uint32_t i = 0; i < count; i++)
			for (uint32_t k = 0; s[i].rank == rank && k < s[i].triangle_count; k++) {
				if (i == at.shape && (k >= at.prim || rank != SURFACE_EMITS))
					return at;
				if (rank == s[at.shape].rank && i > at.shape)
					return at;
				const struct triangle u = triangle_from(s[i].position, s[i].index[k]);
				double unused;
				bool wholly;
				if (triangle_intersect(&u, p, t.n, &unused) && coincide_triangles(&t, &u, 0, &wholly))
					return (struct prim_ref){i, k, 0};
			}
	return at;
}

static vec3 point_on(const struct accel_shape *s, uint32_t prim, struct dice *d)
{
	const struct triangle t = triangle_from(s->position, s->index[prim]);
	double root = sqrt(dice_uniform(d)), u = 1 - root, v = root * dice_uniform(d);
	return vec3_madd(vec3_madd(t.v[0], u, vec3_sub(t.v[1], t.v[0])), v, vec3_sub(t.v[2], t.v[0]));
}

/* Triangles of all sizes in a few planes that cross; their coordinates are exact in float, so that all triangles of
 * one plane coincide. */
static void fill_planes(struct triangle_soup *s, uint32_t count, struct dice *d)
{
	for (s->count = 0; s->count < count;) {
		double c[3][2], plane = dice_below(d, 4) / 8.0, size = exp2(-1.0 - dice_below(d, 6)),
				x = dice_between(d, -1, 1), y = dice_between(d, -1, 1);
		vec3 v[3];
		unsigned axis = dice_below(d, 3);
		draw_corners(d, c);
		for (int i = 0; i < 3; i++) {
			double u = x + size * c[i][0], w = y + size * c[i][1];
			v[i] = axis == 0 ? (vec3){plane, u, w} : axis == 1 ? (vec3){u, plane, w} : (vec3){u, w, plane};
		}
		add_triangle(s, v[0], v[1], v[2]);
	}
}

static void search_finds_the_present_primitive(void **state)
{
	(void)state;
	static struct triangle_soup soup[5];
	static const enum surface_rank rank[5] = {SURFACE_TRANSMITS, SURFACE_OPAQUE, SURFACE_EMITS, SURFACE_OPAQUE,
						  SURFACE_SEE_THROUGH};
	struct dice d = dice_for_test("search");
	struct accel_shape shape[5];
	struct coincidence *c;
	struct error e;
	size_t hidden = 0;
	for (int i = 0; i < 5; i++) {
		fill_planes(&soup[i], 150, &d);
		shape[i] = shape_of(&soup[i], rank[i]);
	}
	assert_int_equal(coincide_find(&c, shape, 5, &e), 0);
	assert_non_null(c);
	assert_false(c->is_incomplete);
	for (size_t n = dice_scaled_count(20000); n > 0; n--) {
		struct prim_ref at = {dice_below(&d, 5), dice_below(&d, 150), 0};
		vec3 p = point_on(&shape[at.shape], at.prim, &d);
		struct prim_ref actual = coincide_present_prim(c, shape, at, p),
				expected = present_prim_by_rule(shape, 5, at, p);
		if (actual.shape != expected.shape || actual.prim != expected.prim)
			fail_msg("on %u.%u it is %u.%u that is there, not %u.%u", at.shape, at.prim, expected.shape,
				 expected.prim, actual.shape, actual.prim);
		hidden += actual.shape != at.shape;
	}
	print_message("%zu pairs of primitives, %zu of shapes; %zu of the points hidden\n", c->pair_count,
		      c->shape_pair_count, hidden);
	assert_true(hidden > 0 && c->shape_pair_count > 4);
	coincide_free(c);
}

/* A plant whose round leaves, made of fans of thin triangles, cross each other everywhere: no two coincide, and the
 * search finishes. */
static void crossing_leaves_do_not_coincide(void **state)
{
	(void)state;
	enum { LEAVES = 36, FAN = 256 };
	static struct triangle_soup soup[LEAVES];
	struct accel_shape shape[LEAVES];
	struct dice d = dice_for_test("leaves");
	struct coincidence *c;
	struct error e;
	for (int i = 0; i < LEAVES; i++) {
		vec3 center = {dice_between(&d, -0.3, 0.3), dice_between(&d, -0.4, 0.4), dice_between(&d, -0.3, 0.3)},
		     n = vec3_normalize(
			     (vec3){dice_between(&d, -1, 1), dice_between(&d, -1, 1), dice_between(&d, -1, 1)}),
		     s = vec3_normalize(vec3_cross(n, (vec3){0.48, 0.6, 0.64})), t = vec3_cross(n, s);
		soup[i].count = 0;
		for (int k = 0; k < FAN; k++) {
			vec3 rim[2];
			for (int j = 0; j < 2; j++) {
				double phi = 2 * M_PI * (k + j) / FAN;
				rim[j] = vec3_madd(vec3_madd(center, 0.15 * cos(phi), s), 0.15 * sin(phi), t);
			}
			add_triangle(&soup[i], center, rim[0], rim[1]);
		}
		shape[i] = shape_of(&soup[i], SURFACE_SEE_THROUGH);
	}
	assert_int_equal(coincide_find(&c, shape, LEAVES, &e), 0);
	assert_null(c);
}

enum { TUBES = 400, TWINS = 2, AROUND = 256 };

struct tube {
	float position[2 * AROUND + 2][3];
	uint32_t index[2 * AROUND][3];
};

/* Returns the part [first, last] of the tube from a to b. */
static struct accel_shape make_tube(struct tube *t, vec3 a, vec3 b, double first, double last)
{
	struct frame f = frame_around(vec3_normalize(vec3_sub(b, a)));
	for (uint32_t i = 0; i < 2 * AROUND; i++) {
		double phi = 2 * M_PI * (i / 2) / AROUND, radius = 0.001;
		vec3 p = vec3_madd(a, i % 2 ? last : first, vec3_sub(b, a));
		p = vec3_madd(vec3_madd(p, radius * cos(phi), f.s), radius * sin(phi), f.t);
		t->position[i][0] = (float)p.x;
		t->position[i][1] = (float)p.y;
		t->position[i][2] = (float)p.z;
		for (uint32_t k = 0; k < 3; k++)
			t->index[i][k] = (i + k) % (2 * AROUND);
	}
	return (struct accel_shape){.vertex_count = 2 * AROUND,
				    .triangle_count = 2 * AROUND,
				    .position = (const float(*)[3])t->position,
				    .index = (const uint32_t(*)[3])t->index,
				    .rank = SURFACE_OPAQUE};
}

/* Long thin skewed tubes, whose boxes overlap everywhere. The search finishes, which it would not if it compared the
 * triangles of only a few per cent of the pairs, and it finds each tube that is a part of another. */
static void search_among_long_tubes_finishes(void **state)
{
	(void)state;
	struct tube *tube = mem_alloc(TUBES + TWINS, sizeof *tube);
	static struct accel_shape shape[TUBES + TWINS];
	struct dice d = dice_for_test("tubes");
	struct coincidence *c;
	struct error e;
	assert_non_null(tube);
	for (int i = 0; i < TUBES; i++) {
		vec3 a, b;
		do {
			a = (vec3){dice_between(&d, -0.5, 0.5), dice_between(&d, -0.5, 0.5),
				   dice_between(&d, -0.5, 0.5)};
			b = (vec3){dice_between(&d, -0.5, 0.5), dice_between(&d, -0.5, 0.5),
				   dice_between(&d, -0.5, 0.5)};
		} while (vec3_length(vec3_sub(b, a)) < 0.2);
		shape[i] = make_tube(&tube[i], a, b, 0, 1);
		if (i < TWINS)
			shape[TUBES + i] = make_tube(&tube[TUBES + i], a, b, 0.3, 0.8);
	}
	assert_int_equal(coincide_find(&c, shape, TUBES + TWINS, &e), 0);
	assert_non_null(c);
	assert_false(c->is_incomplete);
	for (uint32_t i = 0; i < TWINS; i++) {
		bool seen[2 * AROUND] = {false};
		size_t hidden = 0;
		for (size_t k = c->first_pair[TUBES + i]; k < c->first_pair[TUBES + i + 1]; k++)
			if (c->pairs[k].covering.shape == i && !seen[c->pairs[k].hidden.prim]) {
				seen[c->pairs[k].hidden.prim] = true;
				hidden++;
			}
		if (hidden != 2 * AROUND)
			fail_msg("of a part of tube %u %zu triangles of %d are seen to be one with it", i, hidden,
				 2 * AROUND);
	}
	print_message("%zu pairs of primitives, %zu of shapes\n", c->pair_count, c->shape_pair_count);
	coincide_free(c);
	mem_free(tube);
}

/* A stack of equal triangles does not need a quadratic number of pairs; a heap that does ends at the search's bounds.
 * If nothing coincides, no result is kept; one sphere hides another; and an allocation failure gives an error
 * message. */
static void search_ends_at_its_bounds(void **state)
{
	(void)state;
	static struct triangle_soup s, other;
	struct dice d = dice_for_test("bounds");
	struct coincidence *c;
	struct error e;
	s.count = 0;
	for (int i = 0; i < TRIANGLES_MAX; i++)
		add_triangle(&s, (vec3){0, 0, 0}, (vec3){1, 0, 0}, (vec3){0, 1, 0});
	struct accel_shape shape[2] = {shape_of(&s, SURFACE_EMITS)};
	assert_int_equal(coincide_find(&c, shape, 1, &e), 0);
	assert_int_equal(c->pair_count, TRIANGLES_MAX - 1);
	assert_false(c->is_incomplete);
	coincide_free(c);
	for (s.count = 0; s.count < TRIANGLES_MAX;) {
		double turn = dice_between(&d, 0, 6);
		add_triangle(&s, (vec3){cos(turn), sin(turn), 0}, (vec3){cos(turn + 2), sin(turn + 2), 0},
			     (vec3){cos(turn + 4), sin(turn + 4), 0});
	}
	assert_int_equal(coincide_find(&c, shape, 1, &e), 0);
	assert_true(c->is_incomplete && c->pair_count > TRIANGLES_MAX && c->pair_count < 64 * TRIANGLES_MAX);
	coincide_free(c);
	shape[0] = shape_of(&s, SURFACE_OPAQUE);
	assert_int_equal(coincide_find(&c, shape, 1, &e), 0);
	assert_null(c);
	struct accel_shape ball[3] = {
		{.is_sphere = true, .center = {0.1, 0.2, 0.3}, .radius = 0.5, .rank = SURFACE_TRANSMITS}};
	ball[1] = ball[2] = ball[0];
	ball[1].radius *= 1 + 1e-9;
	ball[2].radius *= 1 + 1e-5;
	assert_int_equal(coincide_find(&c, ball, 3, &e), 0);
	assert_int_equal(c->pair_count, 1);
	assert_int_equal(coincide_present_prim(c, ball, (struct prim_ref){1, 0, 0}, ball[1].center).shape, 0);
	assert_int_equal(coincide_present_prim(c, ball, (struct prim_ref){2, 0, 0}, ball[2].center).shape, 2);
	coincide_free(c);
	s.count = other.count = 0;
	add_triangle(&s, (vec3){0, 0, 0}, (vec3){1, 0, 0}, (vec3){0, 1, 0});
	add_triangle(&other, (vec3){0, 0, 0}, (vec3){1, 1, 0}, (vec3){0, 1, 0});
	shape[0] = shape_of(&s, SURFACE_OPAQUE);
	shape[1] = shape_of(&other, SURFACE_EMITS);
	int rc = -ENOMEM;
	for (long n = 0; n < 20 && rc; n++) {
		mem_fail_after(n);
		rc = coincide_find(&c, shape, 2, &e);
		mem_fail_after(-1);
		assert_true(rc == 0 || (rc == -ENOMEM && c == NULL && e.text[0]));
	}
	assert_int_equal(rc, 0);
	coincide_free(c);
}

/* ---- rays ---- */

/* A turned pane and a smaller lamp in its plane: the right one is met from both sides, rays that leave one do not
 * meet the other, and no segment begins or ends on a hidden surface. */
static void rays_ignore_hidden_surfaces(void **state)
{
	(void)state;
	static struct triangle_soup s[2];
	struct dice d = dice_for_test("rays");
	size_t lamp = 0, pane = 0, on_hidden = 0;
	for (size_t n = dice_scaled_count(2000); n > 0; n--) {
		struct frame f = frame_around(dice_direction(&d));
		vec3 at = vec3_scale(0.4, dice_direction(&d));
		struct coincidence *c;
		struct accel *a;
		struct error e;
		for (int k = 0; k < 2; k++) {
			double w = k ? 0.25 : 0.5, turn = k ? 0.3 : 0;
			const double co = w * cos(turn), si = w * sin(turn),
				     corner[2][3][2] = {
					     {{co - si, si + co}, {-co - si, -si + co}, {-co + si, -si - co}},
					     {{co - si, si + co}, {-co + si, -si - co}, {co + si, si - co}}};
			s[k].count = 0;
			for (int i = 0; i < 2; i++)
				add_triangle_in_plane(&s[k], &f, at, 1, corner[i]);
		}
		const struct accel_shape shape[2] = {shape_of(&s[0], SURFACE_TRANSMITS),
						     shape_of(&s[1], SURFACE_EMITS)};
		assert_int_equal(coincide_find(&c, shape, 2, &e), 0);
		assert_non_null(c);
		assert_int_equal(accel_new(&a, shape, 2, c, &e), 0);
		for (int i = 0; i < 20; i++) {
			double x = dice_between(&d, -0.48, 0.48), y = dice_between(&d, -0.48, 0.48);
			double u = x * cos(0.3) + y * sin(0.3), v = y * cos(0.3) - x * sin(0.3),
			       edge = fmax(fabs(u), fabs(v)) - 0.25;
			if (fabs(edge) < 1e-5)
				continue;
			vec3 p = vec3_madd(vec3_madd(at, x, f.s), y, f.t), w = dice_direction(&d);
			if (fabs(vec3_dot(w, f.n)) < 0.01)
				continue;
			struct ray_end eye = {vec3_madd(p, -1, w), {0, 0, 0}, PRIM_NONE},
				       far = {vec3_madd(p, 1, w), {0, 0, 0}, PRIM_NONE};
			struct ray_hit hit;
			uint32_t right = edge < 0;
			if (!accel_closest(a, &eye, w, 0, INFINITY, &hit) || hit.prim.shape != right)
				fail_msg("a ray meets %u where %u is there", hit.prim.shape, right);
			assert_true(accel_occluded(a, &eye, &far));
			const struct geom_shape g = {.vertex_count = 6,
						     .triangle_count = 2,
						     .position = s[right].position,
						     .index = s[right].index};
			struct surface_point q;
			surface_from_hit(&g, eye.p, w, &hit, &q);
			struct ray_end from = body_ray_end(&q);
			if (accel_closest(a, &from, w, 0, INFINITY, &hit) || accel_occluded(a, &from, &far) ||
			    accel_occluded(a, &eye, &from) || accel_occluded_to_infinity(a, &from, w))
				fail_msg("what leaves shape %u meets the one that it coincides with", right);
			lamp += right;
			pane += !right;
			if (!right)
				continue;
			/* The point of the pane at the same position. */
			struct triangle t = triangle_from(shape[0].position, shape[0].index[0]);
			double unused;
			struct prim_ref prim = {0, triangle_intersect(&t, p, f.n, &unused) ? 0 : 1, 0};
			struct ray_end hidden = {p, f.n, prim};
			assert_false(accel_closest(a, &hidden, w, 0, INFINITY, &hit));
			assert_true(accel_occluded(a, &hidden, &far) && accel_occluded(a, &eye, &hidden) &&
				    accel_occluded_to_infinity(a, &hidden, w));
			on_hidden++;
		}
		accel_free(a);
		coincide_free(c);
	}
	print_message("%zu rays on the lamp, %zu on the pane, %zu ends on what is hidden\n", lamp, pane, on_hidden);
	assert_true(lamp > 0 && pane > 0);
}

/* The parts of a disk meet in its middle, where the coordinates, and with them their rounding errors, are 0. */
static void parts_of_a_disk_do_not_coincide(void **state)
{
	(void)state;
	enum { PARTS = 256 };
	static struct triangle_soup s;
	struct dice d = dice_for_test("fan");
	for (size_t n = dice_scaled_count(200); n > 0; n--) {
		struct frame f = frame_around(dice_direction(&d));
		vec3 rim[PARTS + 1];
		double size = exp2(dice_between(&d, -12, 0)), wide = size * dice_between(&d, 0.01, 1);
		for (int i = 0; i < PARTS; i++) {
			double angle = 2 * M_PI * i / PARTS;
			rim[i] = vec3_madd(vec3_scale(size * cos(angle), f.s), wide * sin(angle), f.t);
		}
		rim[PARTS] = rim[0];
		s.count = 0;
		for (int i = 0; i < PARTS; i++)
			add_triangle(&s, (vec3){0, 0, 0}, rim[i], rim[i + 1]);
		for (uint32_t i = 0; i < PARTS; i++)
			for (uint32_t k = 0; k < i; k++) {
				const struct triangle a = triangle_at(&s, i), b = triangle_at(&s, k);
				bool unused;
				if (coincide_triangles(&a, &b, 0, &unused) || coincide_triangles(&b, &a, 0, &unused))
					fail_msg("parts %u and %u of a disk of %g by %g coincide", i, k, size, wide);
			}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(two_triangles_coincide_if_they_overlap_in_one_plane),
					   cmocka_unit_test(neighbours_never_coincide),
					   cmocka_unit_test(search_finds_the_present_primitive),
					   cmocka_unit_test(search_ends_at_its_bounds),
					   cmocka_unit_test(search_among_long_tubes_finishes),
					   cmocka_unit_test(crossing_leaves_do_not_coincide),
					   cmocka_unit_test(rays_ignore_hidden_surfaces),
					   cmocka_unit_test(parts_of_a_disk_do_not_coincide)};
	return cmocka_run_group_tests_name("coinciding surfaces", tests, NULL, NULL);
}
