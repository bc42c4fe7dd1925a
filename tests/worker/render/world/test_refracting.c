/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Points on refracting surfaces: their positions, and their ranking, against optical path lengths computed in another
 * way. Deterministic.
 */
#include "tests/support/dice.h"
#include "tests/support/worlds.h"
#include "worker/render/world/refracting.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

/* clang-format off */
#define WATER(eta) "<bsdf type='dielectric'><float name='int_ior' value='" eta "'/><float name='ext_ior' value='1'/></bsdf>"
#define SURFACE(bsdf)                                                                                                 \
	"<shape type='rectangle'><transform name='to_world'><scale x='4' y='2'/><rotate x='1' angle='-90'/></transform>"  \
	bsdf "</shape>"
#define FLOOR                                                                                                         \
	"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/>"                \
	"<translate y='-3'/></transform><bsdf type='diffuse'/></shape>"
#define LAMP "<emitter type='point'><point name='position' x='5' y='4' z='3'/></emitter>"
/* clang-format on */

static struct world *world_with(const char *shapes)
{
	return world_from_text(8, 8, "%s%s%s%s", SENSOR("0,1,6", "0,0,0"), FLOOR, LAMP, shapes);
}

/* Returns the position of point i in scene units. */
static vec3 point_position(const struct world *w, uint32_t i)
{
	return vec3_add(vec3_scale(1 / w->scale, w->refracting_points[i].p), w->center);
}

static vec3 in_world(const struct world *w, vec3 p)
{
	return vec3_scale(w->scale, vec3_sub(p, w->center));
}

/* The water has an area of 32 and the ball one of 4 pi: each gets its share of 128 points, and so does each half of
 * the water and of the ball. */
static void test_points_are_spread_by_area(void **state)
{
	(void)state;
	struct world *w = world_with(SURFACE(
		WATER("1.33")) "<shape type='sphere'><point name='center' x='0' y='4' z='0'/>" WATER("1.5") "</shape>");
	uint32_t on_water = 0, left = 0, behind = 0, ball_low = 0;
	assert_int_equal(w->refracting_point_count, 128);
	for (uint32_t i = 0; i < 128; i++) {
		const struct refracting_point *q = &w->refracting_points[i];
		vec3 p = point_position(w, i), out = vec3_sub(p, (vec3){0, 4, 0});
		if (fabs(p.y) < 1e-5) {
			assert_true(fabs(p.x) <= 4 && fabs(p.z) <= 2 && q->n.y > 1 - 1e-6);
			assert_true(fabs(q->eta - 1.33) < 1e-6);
			on_water++;
			left += p.x < 0;
			behind += p.z < 0;
		} else {
			assert_true(fabs(vec3_length(out) - 1) < 1e-5 && vec3_dot(out, q->n) > 1 - 1e-5);
			assert_true(fabs(q->eta - 1.5) < 1e-6);
			ball_low += out.y < 0;
		}
	}
	double share = 32 / (32 + 4 * M_PI) * 128;
	assert_true(fabs(on_water - share) <= 1);
	assert_true(fabs(left - share / 2) <= 4 && fabs(behind - share / 2) <= 4);
	assert_true(fabs(ball_low - (128 - share) / 2) <= 3);
	/* A point in front of the ball counts as outside, although the ball's far side faces away from it. */
	const struct refracting_point *by[REFRACTING_POINTS_RANKED];
	const struct refracting_light from = {{0, 1, 0}, true};
	assert_int_equal(refracting_points_rank(w, in_world(w, (vec3){0, 2.5, 0}), &from, by), 0);
	assert_int_equal(refracting_points_rank(w, in_world(w, (vec3){0, 4, 0}), &from, by), REFRACTING_POINTS_RANKED);
	world_free(w);
}

/* Two meshes: the fine one, with a hundredth of the area, has about a hundredth of the points. */
static void test_triangle_count_does_not_matter(void **state)
{
	(void)state;
	struct world *w =
		world_with(SURFACE(WATER("1.33")) "<shape type='sphere'><point name='center' x='0' y='4' "
						  "z='0'/><float name='radius' value='.16'/>" WATER("1.5") "</shape>");
	uint32_t on_ball = 0;
	for (uint32_t i = 0; i < w->refracting_point_count; i++)
		on_ball += point_position(w, i).y > 1;
	assert_true(on_ball <= 2);
	world_free(w);
}

static void test_scene_without_refraction_has_no_points(void **state)
{
	(void)state;
	struct refracting_light from = {{0, 1, 0}, true};
	struct world *w = world_with("");
	assert_int_equal(w->refracting_point_count, 0);
	const struct refracting_point *by[REFRACTING_POINTS_RANKED];
	assert_int_equal(refracting_points_rank(w, (vec3){0, 0, 0}, &from, by), 0);
	world_free(w);
	worlds_effects = "-refracted-shadows";
	w = world_with(SURFACE(WATER("1.33")));
	worlds_effects = NULL;
	assert_int_equal(w->refracting_point_count, 0);
	world_free(w);
}

static double path_length(const struct refracting_point *q, vec3 z, vec3 from)
{
	return q->eta * vec3_length(vec3_sub(z, q->p)) + vec3_length(vec3_sub(from, q->p)) -
	       vec3_length(vec3_sub(from, z));
}

/* An end at infinity is represented by a point so far away that its direction is the same from everywhere. */
static void check_shortest_path(const struct world *w, vec3 z, const struct refracting_light *from)
{
	const struct refracting_point *found[REFRACTING_POINTS_RANKED];
	vec3 far = from->is_infinite ? vec3_scale(1e6, from->position) : from->position;
	assert_int_equal(refracting_points_rank(w, z, from, found), REFRACTING_POINTS_RANKED);
	for (uint32_t k = 0; k < REFRACTING_POINTS_RANKED; k++) {
		uint32_t sooner = 0;
		double here = path_length(found[k], z, far);
		for (uint32_t i = 0; i < w->refracting_point_count; i++)
			sooner += path_length(&w->refracting_points[i], z, far) < here - 1e-8;
		assert_true(sooner <= k && (k == 0 || found[k] != found[k - 1]));
	}
}

static void test_shortest_path_is_found(void **state)
{
	(void)state;
	struct dice dice = dice_for_test("soonest");
	const struct refracting_point *by[REFRACTING_POINTS_RANKED];
	/* The second surface has its normal downwards, with the water as its exterior. */
	static const char *const water[] = {
		SURFACE(WATER("1.33")),
		"<shape type='rectangle'><transform name='to_world'><scale x='4' y='2'/><rotate x='1' angle='90'/>"
		"</transform><bsdf type='dielectric'><float name='int_ior' value='1'/><float name='ext_ior' value='1.33'/>"
		"</bsdf></shape>"};
	for (int k = 0; k < 2; k++) {
		struct world *w = world_with(water[k]);
		for (int i = 0; i < 200; i++) {
			vec3 below = {6 * dice_uniform(&dice) - 3, -3 * dice_uniform(&dice) - 1e-3,
				      dice_uniform(&dice)};
			vec3 lamp = {9 * dice_uniform(&dice) - 4, 5 * dice_uniform(&dice), 9 * dice_uniform(&dice) - 4};
			vec3 above = {below.x, -below.y, below.z};
			struct refracting_light near = {in_world(w, lamp), false},
						far = {vec3_normalize((vec3){lamp.x, lamp.y + .1, lamp.z}), true};
			check_shortest_path(w, in_world(w, below), &near);
			check_shortest_path(w, in_world(w, below), &far);
			assert_int_equal(refracting_points_rank(w, in_world(w, above), &near, by), 0);
		}
		world_free(w);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_points_are_spread_by_area),
		cmocka_unit_test(test_triangle_count_does_not_matter),
		cmocka_unit_test(test_scene_without_refraction_has_no_points),
		cmocka_unit_test(test_shortest_path_is_found),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
