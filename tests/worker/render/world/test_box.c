/* SPDX-License-Identifier: Apache-2.0 */
/* Intersection of rays with boxes, against points along the rays; and which surfaces of a scene the box for
 * connections encloses. */
#include "tests/support/dice.h"
#include "tests/support/worlds.h"
#include "worker/render/world/box.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static bool is_inside(const struct box *b, vec3 p, double margin)
{
	return p.x >= b->min.x - margin && p.x <= b->max.x + margin && p.y >= b->min.y - margin &&
	       p.y <= b->max.y + margin && p.z >= b->min.z - margin && p.z <= b->max.z + margin;
}

/* If a point along the ray lies in the box, the ray must meet it; if none comes within `margin`, the spacing of the
 * points, the ray must miss it. */
static void test_rays_meet_the_box_of_their_points(void **state)
{
	(void)state;
	const double out = 1e-3;
	struct dice d = dice_for_test("boxes");
	unsigned met = 0, missed = 0;
	for (int i = 0; i < 2000; i++) {
		struct box b = box_empty();
		for (int k = 0; k < 2; k++)
			box_grow(&b, (vec3){dice_uniform(&d), dice_uniform(&d), i % 3 ? dice_uniform(&d) : 0.5});
		vec3 p = {2 * dice_uniform(&d) - 0.5, 2 * dice_uniform(&d) - 0.5, 2 * dice_uniform(&d) - 0.5};
		vec3 w = vec3_sub((vec3){dice_uniform(&d), dice_uniform(&d), dice_uniform(&d)}, p);
		if (i % 5 == 0)
			w.y = 0;
		if (i % 7 == 0)
			w.z = 0;
		double length = 2 * dice_uniform(&d);
		bool near = false, inside = false;
		w = vec3_normalize(w);
		for (double t = 0; t <= length; t += out) {
			near |= is_inside(&b, vec3_madd(p, t, w), out);
			inside |= is_inside(&b, vec3_madd(p, t, w), 0);
		}
		bool is = box_is_hit(&b, p, w, length);
		assert_true(!inside || is);
		assert_true(near || !is);
		met += is;
		missed += !is;
		assert_true(!is || box_is_hit(&b, p, w, INFINITY));
	}
	print_message("%u met, %u missed\n", met, missed);
	assert_true(met > 100 && missed > 100);
	const struct box none = box_empty();
	assert_false(box_is_hit(&none, (vec3){0, 0, 0}, (vec3){0, 0, 1}, INFINITY));
}

#define PANE(inner, bsdf) \
	"<shape type='rectangle'><transform name='to_world'>" inner "</transform><bsdf type='" bsdf "'/></shape>"

static void test_see_through_bounds_enclose_see_through_shapes(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		16, 16, "%s",
		SENSOR("0,0,9", "0,0,0") "<emitter type='constant'/>" PANE("<translate x='3' y='1'/>", "thindielectric")
			PANE("<translate x='-2' z='2'/>", "null") PANE("<translate y='-5'/>", "diffuse"));
	const double slack = 1e-4;
	const vec3 low = {-3, -1, 0}, high = {4, 2, 2};
	for (int side = 0; side < 2; side++) {
		vec3 p = side ? high : low, q = side ? w->see_through_bounds.max : w->see_through_bounds.min;
		vec3 off = vec3_sub(vec3_add(vec3_scale(1 / w->scale, q), w->center), p);
		if (!side)
			off = vec3_neg(off);
		assert_true(off.x > 0 && off.y > 0 && off.z > 0);
		assert_true(fmax(off.x, fmax(off.y, off.z)) < slack / w->scale);
	}
	world_free(w);
	w = world_from_text(16, 16, "%s", SENSOR("0,0,9", "0,0,0") "<emitter type='constant'/>" PANE("", "diffuse"));
	assert_true(w->see_through_bounds.min.x > w->see_through_bounds.max.x);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_rays_meet_the_box_of_their_points),
		cmocka_unit_test(test_see_through_bounds_enclose_see_through_shapes),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
