/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Large shapes in a scene of mixed scales lie where the scene says: a floor that is turned about a skew axis and
 * centred elsewhere, so that each of its vertices is rounded differently, under a cube of size 1. Hits of rays, and
 * points at which light starts, must lie on the plane described in the scene, to double precision relative to the
 * floor's size; and a lamp that hangs over the floor must not coincide with it.
 */
#include "tests/support/dice.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

/* clang-format off */
#define TURN "<rotate x='1' z='0.3' angle='20'/>"
#define AT(inner) "<transform name='to_world'>" inner TURN "</transform>"
#define SHINES "<emitter type='area'><rgb name='radiance' value='1'/></emitter>"
static const char text[] =
	SENSOR("0,3,8", "0,0,0")
	"<shape type='cube'>" AT("<scale value='0.5'/><translate y='0.75'/>") "</shape>"
	"<shape type='rectangle'>" AT("<scale value='0.7'/><rotate x='1' angle='90'/><translate y='3'/>") SHINES "</shape>"
	"<shape type='%s'>" AT("<rotate x='1' angle='-90'/><translate x='0.3' z='-0.41' y='%g'/><scale value='%.17g'/>") "%s</shape>";
/* clang-format on */

static const struct wide_shape {
	const char *type;
	double y; /* height of its middle that puts the upper side at 0 */
} forms[] = {{"rectangle", 0}, {"disk", 0}, {"cube", -1}};

/* Returns TURN applied to (0,1,0), by Rodrigues' formula. */
static vec3 rotated_up(void)
{
	double l = sqrt(1.09), c = cos(M_PI / 9), s = sin(M_PI / 9);
	return (vec3){-s * 0.3 / l, c, s / l};
}

/* Returns the height over the plane in scene units. */
static double height_above_plane(const struct world *w, vec3 p)
{
	return vec3_dot(rotated_up(), vec3_add(vec3_scale(1 / w->scale, p), w->center));
}

/* Returns the largest distance of n hits from the plane; the rays start within a few units above the floor and run in
 * all directions. */
static double max_hit_distance(const struct world *w, struct dice *d, size_t n)
{
	double most = 0;
	size_t met = 0;
	for (size_t i = 0; i < n; i++) {
		vec3 o = {dice_between(d, -3, 3), dice_between(d, -3, 3), dice_between(d, -3, 3)};
		o = vec3_madd(o, dice_between(d, 0.01, 4) - vec3_dot(o, rotated_up()), rotated_up());
		vec3 toward = dice_direction(d);
		if (vec3_dot(toward, rotated_up()) > 0)
			toward = vec3_neg(toward);
		toward = vec3_normalize(vec3_madd(toward, -0.1, rotated_up()));
		const struct ray_end from = {.p = vec3_scale(w->scale, vec3_sub(o, w->center)), .prim = PRIM_NONE};
		struct ray_hit hit;
		struct surface_point x;
		assert_true(accel_closest(w->accel, &from, toward, 0, INFINITY, &hit));
		if (hit.prim.shape != 2)
			continue;
		surface_from_hit(&w->shapes[2], from.p, toward, &hit, &x);
		most = fmax(most, fabs(height_above_plane(w, x.p)));
		met++;
	}
	assert_true(met > n / 2);
	return most;
}

/* Returns the largest distance from the plane of n points sampled on the light. */
static double max_sample_distance(const struct world *w, struct dice *d, size_t n)
{
	const struct emitter *em = &w->emitters[1];
	double most = 0;
	assert_int_equal(w->emitter_count, 2);
	for (size_t i = 0; i < n; i++) {
		double u[2] = {dice_between(d, 0, 1), dice_between(d, 0, 1)}, pdf;
		struct emitter_point x;
		assert_true(em->ops->sample_point(em, u, &x, &pdf));
		most = fmax(most, fabs(height_above_plane(w, x.p)));
	}
	return most;
}

static void test_wide_shapes_are_hit_and_sampled_on_their_plane(void **state)
{
	(void)state;
	struct dice d = dice_for_test("wide");
	for (size_t k = 0; k < sizeof forms / sizeof *forms; k++)
		for (double b = 1e4; b < 3e10; b *= 10) {
			bool shines = forms[k].y == 0;
			struct world *w =
				world_from_text(8, 8, text, forms[k].type, forms[k].y, b, shines ? SHINES : "");
			double off = max_hit_distance(w, &d, 1000),
			       light_off = shines ? max_sample_distance(w, &d, 1000) : 0;
			print_message("%s of %.0e: met %.2g off its plane, light %.2g\n", forms[k].type, b, off,
				      light_off);
			assert_true(off <= 1e-5 + 0x1p-49 * b && light_off <= 1e-5 + 0x1p-49 * b);
			assert_null(w->coincidence);
			world_free(w);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_wide_shapes_are_hit_and_sampled_on_their_plane)};
	return cmocka_run_group_tests_name("wide shapes", tests, NULL, NULL);
}
