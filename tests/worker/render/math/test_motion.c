/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Motion between keyframes, against rotations about an axis by a share of an angle: R(s angle) A ((1 - s) S0 + s S1)
 * and a point on a line, with S0 and S1 made of their eigenvectors, so that the expected values use neither
 * quaternions nor a decomposition. Bounds contain every point at any time, and are not much larger than necessary.
 */
#include "tests/support/dice.h"
#include "worker/render/math/motion.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static mat4 random_rotation(struct dice *d)
{
	return mat4_rotate(dice_direction(d), dice_between(d, 0, 360));
}

static mat4 transposed(mat4 a)
{
	mat4 r = mat4_identity();
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			r.m[i][k] = a.m[k][i];
	return r;
}

/* Returns a symmetric stretch with factors from 1/8 to 8. */
static mat4 random_stretch(struct dice *d)
{
	mat4 v = random_rotation(d);
	vec3 s = {exp2(dice_between(d, -3, 3)), exp2(dice_between(d, -3, 3)), exp2(dice_between(d, -3, 3))};
	return mat4_mul(v, mat4_mul(mat4_scale(s), transposed(v)));
}

static mat4 mix_matrices(mat4 a, mat4 b, double s)
{
	for (int i = 0; i < 4; i++)
		for (int k = 0; k < 4; k++)
			a.m[i][k] = (1 - s) * a.m[i][k] + s * b.m[i][k];
	return a;
}

/* A motion from one keyframe to another. */
struct key_motion {
	mat4 rotation, from_stretch, to_stretch;
	vec3 axis, begin, end;
	double angle, handedness;
};

static struct key_motion random_key_motion(struct dice *d)
{
	struct key_motion p = {.rotation = random_rotation(d),
			       .from_stretch = random_stretch(d),
			       .to_stretch = random_stretch(d),
			       .axis = dice_direction(d),
			       .begin = vec3_scale(3, dice_direction(d)),
			       .end = vec3_scale(3, dice_direction(d)),
			       .angle = dice_between(d, 0, 179),
			       .handedness = dice_uniform(d) < 0.5 ? -1 : 1};
	return p;
}

static mat4 expected_transform(const struct key_motion *p, double s)
{
	const vec3 hand = {p->handedness, p->handedness, p->handedness};
	mat4 r = mat4_mul(mat4_rotate(p->axis, s * p->angle),
			  mat4_mul(p->rotation, mix_matrices(p->from_stretch, p->to_stretch, s)));
	vec3 position = vec3_madd(vec3_scale(1 - s, p->begin), s, p->end);
	return mat4_mul(mat4_translate(position), mat4_mul(r, mat4_scale(hand)));
}

static void assert_same(const mat4 *a, const mat4 *b)
{
	for (int i = 0; i < 4; i++)
		for (int k = 0; k < 4; k++)
			if (!(fabs(a->m[i][k] - b->m[i][k]) <= 1e-12 * 8))
				fail_msg("[%d][%d] is %.17g, not %.17g", i, k, a->m[i][k], b->m[i][k]);
}

static void motion_between_two_keyframes_turns_and_stretches_evenly(void **state)
{
	(void)state;
	struct dice d = dice_for_test("motion between two keyframes");
	for (size_t n = dice_scaled_count(2000); n > 0; n--) {
		const struct key_motion p = random_key_motion(&d);
		const struct keyframe key[2] = {{-1, expected_transform(&p, 0)}, {3, expected_transform(&p, 1)}};
		const struct animation a = {2, key};
		struct motion_key key_storage[2];
		struct motion m;
		double open = dice_between(&d, -1, 2), close = dice_between(&d, open + 0.1, 3), t = dice_uniform(&d);
		assert_true(motion_make(&m, &a, open, close, key_storage));
		mat4 got = motion_transform_at(&m, t),
		     right = expected_transform(&p, (open + t * (close - open) + 1) / 4);
		assert_same(&got, &right);
	}
}

/* Nine keyframes of one motion; before the first and after the last, nothing moves. */
static void nine_keyframes_give_the_motion_of_two(void **state)
{
	(void)state;
	struct dice d = dice_for_test("motion along many keyframes");
	for (size_t n = dice_scaled_count(500); n > 0; n--) {
		const struct key_motion p = random_key_motion(&d);
		struct keyframe key[9];
		for (int i = 0; i < 9; i++) /* at unequal distances */
			key[i] = (struct keyframe){i * (i + 1) / 72.0, expected_transform(&p, i * (i + 1) / 72.0)};
		const struct animation a = {9, key};
		struct motion_key key_storage[9];
		struct motion m;
		assert_true(motion_make(&m, &a, -1, 2, key_storage));
		for (int k = 0; k < 8; k++) {
			double t = dice_uniform(&d);
			mat4 got = motion_transform_at(&m, t),
			     right = expected_transform(&p, fmin(fmax(3 * t - 1, 0), 1));
			assert_same(&got, &right);
		}
	}
}

/* Only motion while the shutter is open counts, and a shutter counts as open only if it is open for some time. */
static void motion_counts_only_while_the_shutter_is_open(void **state)
{
	(void)state;
	mat4 rest_transform = mat4_identity(), moved_transform = mat4_translate((vec3){4, 0, 0});
	const struct keyframe key[4] = {
		{0, rest_transform}, {1, rest_transform}, {2, moved_transform}, {3, moved_transform}};
	const struct animation a = {4, key};
	struct motion_key key_storage[4];
	struct motion m;
	assert_false(motion_make(&m, &a, 0, 1, key_storage));
	assert_false(motion_make(&m, &a, 2, 3, key_storage));
	assert_false(motion_make(&m, &a, 5, 9, key_storage));
	assert_false(motion_make(&m, &a, 1.25, 1.25, key_storage));
	mat4 transform = motion_transform_at(&m, 0);
	assert_true(transform.m[0][3] == 1);
	assert_true(motion_make(&m, &a, 1.5, 1.75, key_storage));
	transform = motion_transform_at(&m, 1);
	assert_true(transform.m[0][3] == 3);
	assert_true(motion_make(&m, &a, -8, 8, key_storage));
	assert_int_equal(m.count, 4);
	assert_true(motion_make(&m, &a, 1.5, 1.75, key_storage));
	assert_int_equal(m.count, 2);
	motion_rescale(&m, (vec3){1, 2, 3}, 0.5);
	transform = motion_transform_at(&m, 1);
	assert_true(transform.m[0][3] == 1 && transform.m[1][3] == -1 && transform.m[2][3] == -1.5 &&
		    transform.m[0][0] == 0.5);
}

static void widen_bounds(vec3 p, double low[3], double high[3])
{
	const double v[3] = {p.x, p.y, p.z};
	for (int i = 0; i < 3; i++) {
		low[i] = fmin(low[i], v[i]);
		high[i] = fmax(high[i], v[i]);
	}
}

static void bounds_contain_the_whole_motion(void **state)
{
	(void)state;
	struct dice d = dice_for_test("motion's bounds");
	for (size_t n = dice_scaled_count(200); n > 0; n--) {
		const struct key_motion p = random_key_motion(&d);
		const struct keyframe key[3] = {{-0.5, expected_transform(&p, 0)},
						{0.3, expected_transform(&p, 0.7)},
						{0.8, expected_transform(&p, 1)}};
		const struct animation a = {3, key};
		struct motion_key key_storage[3];
		struct motion m;
		vec3 low, high, size = {1, 2, 0.5};
		double min_corner[3] = {INFINITY, INFINITY, INFINITY},
		       max_corner[3] = {-INFINITY, -INFINITY, -INFINITY};
		assert_true(motion_make(&m, &a, 0, 1, key_storage));
		m.pre_transform = mat4_mul(mat4_translate((vec3){0.3, 0, 1}), mat4_rotate((vec3){1, 0, 1}, 30));
		motion_bounds(&m, vec3_neg(size), size, &low, &high);
		for (int i = 0; i <= 1000; i++)
			for (int k = 0; k < 8; k++) {
				const mat4 transform = motion_transform_at(&m, i / 1000.0);
				widen_bounds(mat4_point(&transform,
							(vec3){k & 1 ? -1 : 1, k & 2 ? -2 : 2, k & 4 ? -0.5 : 0.5}),
					     min_corner, max_corner);
			}
		const double l[3] = {low.x, low.y, low.z}, h[3] = {high.x, high.y, high.z};
		double whole =
			max_corner[0] - min_corner[0] + max_corner[1] - min_corner[1] + max_corner[2] - min_corner[2];
		for (int i = 0; i < 3; i++) {
			double loose = 0.01 * whole;
			if (!(l[i] <= min_corner[i] && h[i] >= max_corner[i]))
				fail_msg("[%g, %g] does not hold [%g, %g]", l[i], h[i], min_corner[i], max_corner[i]);
			if (!(l[i] >= min_corner[i] - loose && h[i] <= max_corner[i] + loose))
				fail_msg("[%g, %g] is much more than [%g, %g]", l[i], h[i], min_corner[i],
					 max_corner[i]);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(motion_between_two_keyframes_turns_and_stretches_evenly),
		cmocka_unit_test(nine_keyframes_give_the_motion_of_two),
		cmocka_unit_test(motion_counts_only_while_the_shutter_is_open),
		cmocka_unit_test(bounds_contain_the_whole_motion),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
