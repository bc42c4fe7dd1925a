/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Grids are compared with a slow implementation (tests/support/slow_grid.h). They have random sizes, positions and
 * values, all modes, one or three channels; rays begin inside and outside, some run along axes, in planes of points and
 * through points. The position at which an integral reaches a value is checked by integrating up to it.
 */
#include "worker/render/volume/grid.h"

#include "tests/support/dice.h"
#include "tests/support/slow_grid.h"

#include <fenv.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE_MAX = 20, VALUES_MAX = 3 * SIDE_MAX * SIDE_MAX * SIDE_MAX, BRICKS_MAX = 27 };

struct grid_trial {
	struct grid g;
	float value[VALUES_MAX];
	unsigned char brick_is_full[BRICKS_MAX];
};

static mat4 random_transform(struct dice *d)
{
	vec3 scale = {dice_between(d, 0.3, 3), dice_between(d, 0.3, 3), -dice_between(d, 0.3, 3)};
	vec3 shift = {dice_between(d, -2, 2), dice_between(d, -2, 2), dice_between(d, -2, 2)};
	mat4 turned = mat4_mul(mat4_rotate(dice_direction(d), dice_between(d, 0, 360)), mat4_scale(scale));
	return mat4_mul(mat4_translate(shift), turned);
}

/* is_sparse: all values but those of one or two points are 0. */
static void fill_values(struct grid_trial *t, struct dice *d, bool is_sparse)
{
	size_t count = (size_t)(t->g.channels * t->g.size[0] * t->g.size[1] * t->g.size[2]);
	for (size_t i = 0; i < count; i++)
		t->value[i] = !is_sparse && dice_below(d, 4) ? (float)dice_uniform(d) : 0;
	/* Also at the borders, which matter on the opposite side if the grid repeats. */
	for (int n = 0; n < 2; n++) {
		size_t at = 0;
		for (int i = 2; i >= 0; i--) {
			uint32_t side = (uint32_t)t->g.size[i], border = dice_below(d, 2) ? 0 : side - 1;
			at = at * side + (dice_below(d, 2) ? border : dice_below(d, side));
		}
		t->value[at * (size_t)t->g.channels] = 1;
	}
}

/* A box around the centre of the grid that reaches to a corner, so that it contains much space outside the grid. */
static void set_box(struct grid *g)
{
	mat4 back;
	assert_true(mat4_invert(g->to_cells, &back));
	vec3 middle = mat4_point(&back,
				 (vec3){(g->cell_min[0] + g->cell_max[0]) / 2, (g->cell_min[1] + g->cell_max[1]) / 2,
					(g->cell_min[2] + g->cell_max[2]) / 2}),
	     corner = mat4_point(&back, (vec3){g->cell_min[0], g->cell_min[1], g->cell_min[2]});
	double size = vec3_length(vec3_sub(corner, middle));
	g->world_min = vec3_sub(middle, (vec3){size, size, size});
	g->world_max = vec3_add(middle, (vec3){size, size, size});
	for (int i = 0; i < 3; i++) {
		g->cell_min[i] = -GRID_CELL_MAX;
		g->cell_max[i] = GRID_CELL_MAX;
	}
}

/* Like those of volume.c: the box ends half a cell beyond the points, or at the points if values outside are 0. */
static void make_trial(struct grid_trial *t, struct dice *d, bool upright)
{
	struct grid *g = &t->g;
	*g = (struct grid){.channels = dice_below(d, 2) ? 3 : 1,
			   .is_nearest = dice_below(d, 4) == 0,
			   .wrap = (enum grid_wrap)dice_below(d, 4),
			   .value = t->value,
			   .to_cells = upright ? mat4_identity() : random_transform(d)};
	int most = dice_below(d, 4) ? 6 : SIDE_MAX;
	for (int i = 0; i < 3; i++) {
		bool at_points = g->wrap == GRID_ZERO && !g->is_nearest;
		g->size[i] = 1 + at_points + (int)dice_below(d, (uint32_t)most - 1);
		g->cell_min[i] = at_points || g->is_nearest ? 0 : -0.5;
		g->cell_max[i] = at_points ? g->size[i] - 1 : g->cell_min[i] + g->size[i];
	}
	g->is_world_aligned = g->wrap == GRID_CLAMP && !upright && dice_below(d, 4);
	if (g->is_world_aligned)
		set_box(g);
	fill_values(t, d, dice_below(d, 2));
	memset(t->brick_is_full, 0, sizeof t->brick_is_full);
	assert_true(grid_brick_count(g) <= BRICKS_MAX);
	grid_find_occupied_bricks(g, t->brick_is_full);
	g->occupied_bricks = t->brick_is_full;
}

/* ---- tests ---- */

static void test_values_are_interpolated(void **state)
{
	(void)state;
	static struct grid_trial t;
	struct dice d = dice_for_test("values of grids");
	unsigned inside = 0;
	for (int round = 0; round < 4000; round++) {
		make_trial(&t, &d, round % 2 == 0);
		mat4 back;
		assert_true(mat4_invert(t.g.to_cells, &back));
		for (int i = 0; i < 4; i++) {
			vec3 cells = {dice_between(&d, -6, 7), dice_between(&d, -6, 7), dice_between(&d, -6, 7)};
			if (round % 2 == 0 && i < 2)
				cells = (vec3){floor(cells.x), floor(cells.y), floor(cells.z)};
			vec3 p = mat4_point(&back, cells);
			double x[3], value[3];
			slow_grid_position(&t.g, &(struct grid_ray){p, {0, 0, 0}, 0, 0}, 0, x);
			bool in = grid_eval(&t.g, p, value);
			inside += in;
			assert_true(in == slow_grid_contains(&t.g, p));
			for (int k = 0; k < 3; k++) {
				double wanted = slow_grid_value(&t.g, x, k < t.g.channels ? k : 0);
				if (!in && t.g.wrap == GRID_ZERO)
					wanted = 0;
				if (fabs(value[k] - wanted) > 1e-11)
					fail_msg("round %d, channel %d: %.17g, not %.17g", round, k, value[k], wanted);
			}
		}
	}
	assert_true(inside > 200);
}

/* A ray from anywhere to a point in the box; has_whole_steps: with multiples of 1/2, so that rays meet edges and
 * corners and run within faces. */
static struct grid_ray random_ray(const struct grid *g, struct dice *d, bool has_whole_steps)
{
	double from[3], to[3];
	for (int i = 0; i < 3; i++) {
		from[i] = dice_between(d, -3, SIDE_MAX + 3);
		to[i] = dice_between(d, g->is_world_aligned ? -1 : g->cell_min[i],
				     g->is_world_aligned ? g->size[i] : g->cell_max[i]);
		if (has_whole_steps) {
			to[i] = floor(2 * to[i]) / 2;
			from[i] = to[i] + (int)dice_below(d, 3) - 1;
		}
	}
	mat4 back;
	assert_true(mat4_invert(g->to_cells, &back));
	vec3 a = mat4_point(&back, (vec3){from[0], from[1], from[2]}),
	     b = mat4_point(&back, (vec3){to[0], to[1], to[2]});
	vec3 way = vec3_sub(b, a);
	struct grid_ray r = {a, vec3_dot(way, way) > 0 ? vec3_normalize(way) : (vec3){0, 0, 1}, 0, INFINITY};
	if (dice_below(d, 2))
		r.t0 = dice_between(d, 0, vec3_length(way));
	if (dice_below(d, 2))
		r.t1 = r.t0 + dice_between(d, 0, 2 * vec3_length(way));
	return r;
}

/* A ray that runs within a face where the value jumps may see either side. */
static bool runs_along_discontinuity(const struct grid *g, const struct grid_ray *r)
{
	double a[3], b[3];
	slow_grid_position(g, r, 0, a);
	slow_grid_position(g, r, 1, b);
	for (int i = 0; i < 3; i++)
		if (b[i] == a[i] &&
		    (g->is_nearest ? a[i] == floor(a[i]) : a[i] == g->cell_min[i] || a[i] == g->cell_max[i]))
			return true;
	return false;
}

static void check_reach(const struct grid *g, const struct grid_ray *r, const double sum[3], struct dice *d)
{
	const double weight[3] = {dice_uniform(d), dice_uniform(d), dice_uniform(d)};
	double all = 0, least, up_to[3], passed[3], found = 0;
	for (int k = 0; k < g->channels; k++)
		all += weight[k] * sum[k];
	least = all * dice_between(d, 0, 1);
	assert_true(grid_invert_integral(g, r, weight, all * (1 + 1e-9) + 1e-9, passed) == INFINITY);
	for (int k = 0; k < 3; k++)
		assert_true(fabs(passed[k] - sum[k]) < 1e-12);
	if (!(least > 0))
		return;
	double t = grid_invert_integral(g, r, weight, least, passed);
	assert_true(t >= r->t0 && t <= r->t1);
	grid_integrate(g, &(struct grid_ray){r->o, r->d, r->t0, t}, up_to);
	for (int k = 0; k < g->channels; k++)
		found += weight[k] * up_to[k];
	for (int k = 0; k < 3; k++)
		assert_true(fabs(passed[k] - up_to[k]) < 1e-12);
	if (fabs(found - least) > 1e-13 * (all + 1))
		fail_msg("%.17g reached, not %.17g", found, least);
}

static void test_integrals_along_rays_are_exact(void **state)
{
	(void)state;
	static struct grid_trial t;
	struct dice d = dice_for_test("rays through grids");
	unsigned met = 0;
	for (int round = 0; round < 3000; round++) {
		bool whole = round % 2 == 0;
		make_trial(&t, &d, whole);
		for (int i = 0; i < 4; i++) {
			struct grid_ray r = random_ray(&t.g, &d, whole);
			double sum[3];
			if (runs_along_discontinuity(&t.g, &r))
				continue;
			grid_integrate(&t.g, &r, sum);
			for (int k = 0; k < 3; k++) {
				double wanted = k < t.g.channels ? slow_grid_integral(&t.g, &r, k) : 0;
				if (fabs(sum[k] - wanted) > 1e-11)
					fail_msg("round %d, ray %d, channel %d: %.17g, not %.17g", round, i, k, sum[k],
						 wanted);
			}
			met += sum[0] > 0;
			check_reach(&t.g, &r, sum, &d);
		}
	}
	assert_true(met > 1500);
}

/* Rays from far away, with almost no slope, and with none: results are those of an equivalent ray, never NaN, and never
 * take endless time. */
static void test_extreme_rays_give_finite_results(void **state)
{
	(void)state;
	static struct grid_trial t;
	struct dice d = dice_for_test("hard rays through grids");
	const double slopes[] = {0, -0.0, 1e-320, -1e-320, 1e-200, -1e-200, 1e-30, -1e-17};
	for (int round = 0; round < 2000; round++) {
		make_trial(&t, &d, true);
		double x = dice_between(&d, 0, 3), y = dice_between(&d, 0, 3), sum[3], straight[3];
		double slope = slopes[dice_below(&d, sizeof slopes / sizeof *slopes)];
		struct grid_ray r = {{x, y, -4}, {slope, slope, 1}, 0, INFINITY},
				plain = {{x, y, -4}, {0, 0, 1}, 0, 99};
		bool in_plane = round % 2; /* then a slope may decide on which side of a jump the ray is */
		if (in_plane)
			r.o.x = plain.o.x = floor(x);
		feclearexcept(FE_INVALID);
		grid_integrate(&t.g, &r, sum);
		grid_integrate(&t.g, &plain, straight);
		assert_true(grid_invert_integral(&t.g, &r, (const double[3]){1, 1, 1}, 0, straight) >= 0);
		grid_integrate(&t.g, &plain, straight);
		assert_false(fetestexcept(FE_INVALID)); /* renderers trap it */
		for (int k = 0; k < 3 && !in_plane; k++)
			assert_true(fabs(sum[k] - straight[k]) < 1e-12);
		r.o.z = -1e9;
		grid_integrate(&t.g, &r, sum);
		for (int k = 0; k < 3 && !in_plane; k++)
			assert_true(fabs(sum[k] - straight[k]) < 1e-5);
		const vec3 far[] = {{1e300, 0, 0}, {-1e300, 1e300, 5}, {NAN, 0, 0}, {INFINITY, 0, 0}, {0, 0, -1e308}};
		for (size_t i = 0; i < sizeof far / sizeof *far; i++) {
			r.o = far[i];
			grid_integrate(&t.g, &r, sum);
			assert_true(isfinite(sum[0] + sum[1] + sum[2]));
			assert_true(grid_invert_integral(&t.g, &r, (const double[3]){1, 1, 1}, 1e-3, sum) >= 0);
			assert_true(grid_eval(&t.g, far[i], sum) == false);
			assert_true(isfinite(sum[0] + sum[1] + sum[2]));
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_values_are_interpolated),
		cmocka_unit_test(test_integrals_along_rays_are_exact),
		cmocka_unit_test(test_extreme_rays_give_finite_results),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
