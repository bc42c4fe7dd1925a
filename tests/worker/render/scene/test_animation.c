/* SPDX-License-Identifier: Apache-2.0 */
/* <animation>: the transform or motion that the reader makes of it, and invalid animations, which are refused with a
 * message. */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_tables.h"
#include "worker/render/scene/scene.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static int read_xml(struct scene *s, const char *xml, bool lenient, struct error *e)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {NULL, NULL, 0}};
	const struct asset_source assets = memory_assets(files);
	*e = (struct error){""};
	return lenient ? scene_read_lenient(s, &assets, "s.xml", scene_tables(), NULL, 0, e)
		       : scene_read(s, &assets, "s.xml", scene_tables(), NULL, 0, e);
}

static struct scene read_valid(const char *xml)
{
	struct scene s;
	struct error e;
	if (read_xml(&s, xml, false, &e))
		fail_msg("%s", e.text);
	return s;
}

static void expect_refused(const char *xml, const char *sentence)
{
	struct scene s;
	struct error e;
	int rc = read_xml(&s, xml, false, &e);
	if (rc == 0 || !strstr(e.text, sentence))
		fail_msg("%s\n  gave %d: %s\n  not: %s", xml, rc, e.text, sentence);
}

/* An animation without motion becomes a transform; unsupported motion is reduced to its first transform with
 * `lenient`. */
static void test_animation_becomes_motion_or_transform(void **state)
{
	(void)state;
#define SPHERE(x) "<scene version='3.0.0'><shape type='sphere'>" x "</shape></scene>"
#define AT(t, x) "<transform time='" t "'><translate x='" x "'/></transform>"
	static const char *const still[] = {
		SPHERE("<animation name='to_world'>" AT("0.5", "3") "</animation>"),
		SPHERE("<animation name='animation'>" AT("0", "3") "</animation>"),
		SPHERE("<animation name='to_world'>" AT("0", "3") AT("1", "3") AT("2", "3.0") "</animation>"),
		"<scene version='0.6.0'><shape type='sphere'><animation name='toWorld'>" AT(
			"0", "3") "</animation></shape></scene>",
	};
	for (size_t i = 0; i < sizeof still / sizeof *still; i++) {
		struct scene s = read_valid(still[i]);
		mat4 m = node_transform(s.objects[0], "to_world");
		assert_true(m.m[0][3] == 3 && s.note_count == 0);
		scene_fini(&s);
	}
#define MOVING_BETWEEN(x) "<animation name='animation'>" AT("-0.5", "4") AT("1", x) "</animation>"
	struct scene s = read_valid(
		"<scene version='3.0.0'><shape type='sphere'>" MOVING_BETWEEN("5") "</shape><shape type='sphere'>" MOVING_BETWEEN(
			"6") "</shape><shape type='sphere'>" MOVING_BETWEEN("5") "</shape></scene>");
	const struct animation *a = node_animation(s.objects[0]);
	mat4 m = node_transform(s.objects[0], "to_world");
	assert_true(m.m[0][3] == 4 && s.note_count == 0);
	assert_non_null(a);
	assert_int_equal(a->count, 2);
	assert_true(a->key[0].time == -0.5 && a->key[1].time == 1 && a->key[1].transform.m[0][3] == 5);
	assert_false(node_equals(s.objects[0], s.objects[1]));
	assert_true(node_equals(s.objects[0], s.objects[2]));
	scene_fini(&s);

	struct error e;
	static const char grouped[] =
		"<scene version='3.0.0'><shape type='shapegroup'><shape type='sphere'>" MOVING_BETWEEN(
			"5") "</shape></shape></scene>";
	assert_int_equal(read_xml(&s, grouped, false, &e), -ENOTSUP);
	assert_int_equal(read_xml(&s, grouped, true, &e), 0);
	m = node_transform(s.objects[0]->children[0], "to_world");
	assert_true(m.m[0][3] == 4 && s.note_count == 1 && !node_animation(s.objects[0]->children[0]));
	assert_non_null(
		strstr(s.notes[0], "all but the start of the `motion` is not supported and left out (lenient)"));
	scene_fini(&s);
}

#define S "<scene version='3.0.0'>"
#define END "</scene>"
/* A shape that moves from its position at time 0. */
#define MOVING(type, later, inside) \
	"<shape type='" type "'><animation name='to_world'><transform time='0'/>" later "</animation>" inside "</shape>"
#define TRANSFORM_AT(time, scale) "<transform time='" time "'><scale value='" scale "'/></transform>"

static void test_invalid_animations_are_refused(void **state)
{
	(void)state;
	expect_refused(S "<shape type='sphere'><animation name='toWorld'/></shape>" END, "holds no transform");
	expect_refused(S "<shape type='sphere'><animation name='toWorld'><scale value='2'/></animation></shape>" END,
		       "has no place in <animation>");
	expect_refused(
		S "<shape type='shapegroup'>" MOVING("cube", TRANSFORM_AT("1", "2"), "") "</shape>" END,
		"motion of a shape in a shapegroup is not supported (line 1); --lenient keeps the first transform");
	expect_refused(S MOVING("cube", "<transform/>", "") END, "<transform>: needs a time, a (finite) number");
	expect_refused(S MOVING("cube", "<transform time='soon'/>", "") END, "needs a time, a (finite) number");
	expect_refused(S MOVING("cube", TRANSFORM_AT("nan", "2"), "") END, "needs a time, a (finite) number");
	expect_refused(S MOVING("cube", TRANSFORM_AT("inf", "2"), "") END, "needs a time, a (finite) number");
	expect_refused(S MOVING("cube", TRANSFORM_AT("1e31", "2"), "") END, "time=1e+31 is outside [-1e+30, 1e+30]");
	expect_refused(S MOVING("cube", TRANSFORM_AT("0", "2"), "") END,
		       "time=0 is not after the time of the transform before, 0");
	expect_refused(S MOVING("cube", TRANSFORM_AT("2", "2") TRANSFORM_AT("1", "3"), "") END,
		       "time=1 is not after the time of the transform before, 2");
	expect_refused(S MOVING("cube", TRANSFORM_AT("1", "0"), "") END, "flattens the object (it has no inverse)");
	expect_refused(S MOVING("cube", TRANSFORM_AT("1", "1e-61"), "") END, "makes the object too small");
	expect_refused(S MOVING("cube", "<transform time='1'><scale x='1e-300' y='1e-300'/></transform>", "") END,
		       "more than 1e+12 times as far in one direction");
	expect_refused(S MOVING("cube", "<transform time='1'><scale x='1e13'/></transform>", "") END,
		       "more than 1e+12 times as far in one direction");
	expect_refused(S MOVING("cube", TRANSFORM_AT("1", "-1"), "") END,
		       "either this transform or the one before mirrors the object, but not both");
	expect_refused(S MOVING("cube", TRANSFORM_AT("1", "2") "<scale value='2'/>", "") END,
		       "has no place in <animation>");
	expect_refused(S MOVING("cube", "<transform time='1' tiem='2'/>", "") END, "has no attribute `tiem`");
	expect_refused(S "<shape type='sphere'><animation name='toWorld' tiem='1'><transform/></animation></shape>" END,
		       "has no attribute `tiem`");
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_animation_becomes_motion_or_transform),
					   cmocka_unit_test(test_invalid_animations_are_refused)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
