/* SPDX-License-Identifier: Apache-2.0 */
/* Transforms: products, rotations by known angles, inverses of random matrices, normals that stay perpendicular to the
 * transformed surface, and look-at, against values worked out by hand. */
#include "worker/render/math/mat4.h"

#include "worker/render/math/rng.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void assert_near(double a, double b, double tolerance)
{
	if (!(fabs(a - b) <= tolerance))
		fail_msg("%.17g is not %.17g", a, b);
}

static void assert_vec3(vec3 a, double x, double y, double z, double tolerance)
{
	assert_near(a.x, x, tolerance);
	assert_near(a.y, y, tolerance);
	assert_near(a.z, z, tolerance);
}

static mat4 random_matrix(uint64_t i)
{
	mat4 m = mat4_identity();
	double u[12];
	for (uint64_t b = 0; b < 3; b++)
		rng_uniform4(0x6d617434, RNG_TEST, i, 0, b, u + 4 * b);
	for (int k = 0; k < 12; k++)
		m.m[k / 4][k % 4] = 10 * u[k] - 5;
	return m;
}

static void test_products_apply_right_first(void **state)
{
	(void)state;
	mat4 m = mat4_mul(mat4_translate((vec3){1, 0, 0}), mat4_scale((vec3){2, 2, 2}));
	assert_vec3(mat4_point(&m, (vec3){1, 1, 1}), 3, 2, 2, 0);
	assert_vec3(mat4_vector(&m, (vec3){1, 1, 1}), 2, 2, 2, 0);
}

static void rotations_turn_by_known_angles(void **state)
{
	(void)state;
	mat4 m = mat4_rotate((vec3){0, 0, 2}, 90);
	assert_vec3(mat4_vector(&m, (vec3){1, 0, 0}), 0, 1, 0, 0); /* quarter turns are exact */
	m = mat4_rotate((vec3){1, 0, 0}, 270);
	assert_vec3(mat4_vector(&m, (vec3){0, 1, 0}), 0, 0, -1, 0);
	m = mat4_rotate((vec3){0, 1, 0}, -450);
	assert_vec3(mat4_vector(&m, (vec3){0, 0, 1}), -1, 0, 0, 0);
	m = mat4_rotate((vec3){1, 1, 1}, 120);
	assert_vec3(mat4_vector(&m, (vec3){1, 0, 0}), 0, 1, 0, 1e-15);
	m = mat4_rotate((vec3){0, 0, 1}, 30);
	assert_vec3(mat4_vector(&m, (vec3){1, 0, 0}), sqrt(0.75), 0.5, 0, 1e-15);
}

static void inverse_undoes_a_random_matrix(void **state)
{
	(void)state;
	for (uint64_t i = 0; i < 200; i++) {
		mat4 m = random_matrix(i), inverse;
		assert_true(mat4_invert(m, &inverse));
		mat4 product = mat4_mul(m, inverse);
		for (int k = 0; k < 16; k++)
			assert_near(product.m[k / 4][k % 4], k % 5 == 0, 1e-10);
	}
	mat4 flat = mat4_scale((vec3){1, 0, 1}), inverse;
	assert_false(mat4_invert(flat, &inverse));
	flat.m[1][1] = NAN;
	assert_false(mat4_invert(flat, &inverse));
}

static void test_normals_stay_perpendicular(void **state)
{
	(void)state;
	for (uint64_t i = 0; i < 200; i++) {
		mat4 m = random_matrix(i), inverse;
		mat4_invert(m, &inverse);
		vec3 a = {1, 2, 3}, b = {-2, 0.5, 1}, n = vec3_cross(a, b);
		vec3 nt = mat4_normal(&inverse, n), at = mat4_vector(&m, a), bt = mat4_vector(&m, b);
		double scale = vec3_length(nt) * (vec3_length(at) + vec3_length(bt));
		assert_near(vec3_dot(nt, at), 0, 1e-12 * scale);
		assert_near(vec3_dot(nt, bt), 0, 1e-12 * scale);
		/* The cross product changes sign with the determinant, the normal does not. */
		assert_true(vec3_dot(vec3_cross(at, bt), nt) * mat4_det3(m) > 0);
	}
}

static void look_at_has_known_values(void **state)
{
	(void)state;
	mat4 m = mat4_look_at((vec3){0, -9, 3.5}, (vec3){0, 0, 3.5}, (vec3){0, 0, 1});
	assert_vec3(mat4_vector(&m, (vec3){0, 0, 1}), 0, 1, 0, 1e-15);
	assert_vec3(mat4_vector(&m, (vec3){0, 1, 0}), 0, 0, 1, 1e-15);
	assert_vec3(mat4_vector(&m, (vec3){1, 0, 0}), -1, 0, 0, 1e-15); /* left of a viewer along +y with z up */
	assert_vec3(mat4_point(&m, (vec3){0, 0, 0}), 0, -9, 3.5, 0);
	assert_near(mat4_det3(m), 1, 1e-15);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_products_apply_right_first), cmocka_unit_test(rotations_turn_by_known_angles),
		cmocka_unit_test(inverse_undoes_a_random_matrix),  cmocka_unit_test(test_normals_stay_perpendicular),
		cmocka_unit_test(look_at_has_known_values),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
