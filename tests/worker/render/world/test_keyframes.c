/* SPDX-License-Identifier: Apache-2.0 */
/* Which motions are accepted: worlds in which nothing moves while the shutter is open draw no times and equal static
 * worlds, motions that cannot be represented are refused with an error message, and thousands of keyframes work. */
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#define TO(inner) "<transform name='to_world'>" inner "</transform>"
#define OPEN(a, b) "<float name='shutter_open' value='" a "'/><float name='shutter_close' value='" b "'/>"
#define VIEW(shutter)                                                                                  \
	"<sensor type='perspective'><float name='fov' value='40'/>" shutter TO(                        \
		"<lookat origin='0,0,8' target='0,0,0' up='0,1,0'/>") "<film type='hdrfilm'><rfilter " \
								      "type='box'/></film></sensor>"
#define SKY "<emitter type='constant'/>"
#define FLOOR "<shape type='rectangle'>" TO("<scale value='5'/><translate z='-3'/>") "</shape>"
#define AREA "<emitter type='area'><float name='radiance' value='2'/></emitter>"
#define BEAM "<emitter type='directionalarea'><float name='radiance' value='2'/></emitter>"

static vec3 in_scene(const struct world *w, vec3 p)
{
	return vec3_madd(w->center, 1 / w->scale, p);
}

/* Tolerance in scene units: vertices are rounded to float in the frame of the world. */
#define POSITION_TOLERANCE 1e-5

#define SLIDES(type, inside)                                                                          \
	"<shape type='" type "'><animation name='to_world'><transform time='0'/><transform time='2'>" \
	"<translate x='4'/></transform></animation>" inside "</shape>"
#define CUBE SLIDES("cube", "")

static void check_still_position(const char *shutter, double x)
{
	struct world *w = world_from_text(32, 32, "%s" SKY CUBE, shutter);
	assert_false(w->effects.motion);
	assert_null(w->shapes[0].placement);
	double low = INFINITY, high = -INFINITY;
	for (uint32_t i = 0; i < w->shapes[0].vertex_count; i++) {
		const float *p = w->shapes[0].position[i];
		vec3 at = in_scene(w, (vec3){(double)p[0], (double)p[1], (double)p[2]});
		low = fmin(low, at.x);
		high = fmax(high, at.x);
	}
	assert_true(fabs(low - (x - 1)) < POSITION_TOLERANCE && fabs(high - (x + 1)) < POSITION_TOLERANCE);
	world_free(w);
}

/* Without shutter times in the scene, the shutter opens and closes at 0; a shutter that opens and closes at the same
 * time sees a single position. */
static void test_equal_shutter_times_see_one_position(void **state)
{
	(void)state;
	check_still_position(VIEW(""), 0);
	check_still_position(VIEW(OPEN("0.5", "0.5")), 1);
	check_still_position(VIEW(OPEN("-3", "0")), 0);
	check_still_position(VIEW(OPEN("2", "1e30")), 4);
	check_still_position(VIEW(OPEN("7", "7")), 4);
	worlds_effects = "-motion";
	struct world *w = world_from_text(32, 32, VIEW(OPEN("1", "2")) SKY CUBE);
	worlds_effects = NULL;
	assert_false(w->effects.motion);
	world_free(w);
	w = world_from_text(32, 32, VIEW(OPEN("1.999", "3")) SKY CUBE);
	assert_true(w->effects.motion);
	assert_int_equal(w->sharing_shape_count, 1);
	world_free(w);
}

static void expect_refused(const char *body, const char *sentence)
{
	char xml[2048];
	size_t n = (size_t)snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", body);
	const struct memory_file files[] = {{"s.xml", xml, n}, {NULL, NULL, 0}};
	world_check_files_refused(files, sentence);
}

/* A stretched environment map would look as if it were not stretched, so its transform is refused. */
static void expect_environment_refused(void)
{
	static const char xml[] = "<scene version='3.0.0'>" VIEW(OPEN(
		"0",
		"1")) "<emitter type='envmap'><string name='filename' value='e.pgm'/><animation name='to_world'>"
		      "<transform time='0'/><transform time='1'><scale x='2'/></transform></animation></emitter></scene>";
	const struct memory_file files[] = {
		{"s.xml", xml, sizeof xml - 1}, {"e.pgm", "P5 2 1 255\nab", 13}, {NULL, NULL, 0}};
	world_check_files_refused(files, "an environment that moves may only be turned");
}

static void test_unsupported_motion_is_refused(void **state)
{
	(void)state;
	expect_refused(VIEW(OPEN("1", "0.5")) CUBE, "shutter_open=1 is after shutter_close=0.5");
	expect_refused(VIEW(OPEN("0", "nan")) CUBE, "is not a (finite) number");
#define ROLL(type, duration)                                     \
	"<string name='rolling_shutter_type' value='" type "'/>" \
	"<float name='rolling_shutter_duration' value='" duration "'/>"
	expect_refused(VIEW(OPEN("0", "1") ROLL("row", "0.5")) CUBE, "(supported: none, top, bottom, left, right)");
	expect_refused(VIEW(OPEN("0", "1") "<string name='rolling_shutter_type' value='top'/>") CUBE,
		       "a rolling shutter needs a rolling_shutter_duration");
	expect_refused(VIEW(OPEN("0", "1") ROLL("top", "1.5")) CUBE, "rolling_shutter_duration=1.5 is outside [0, 1]");
	expect_refused(VIEW(OPEN("0", "1") ROLL("top", "-1")) CUBE, "rolling_shutter_duration=-1 is outside [0, 1]");
	expect_refused(VIEW(OPEN("0", "0.5") ROLL("top", "0.2")) CUBE,
		       "it moves, and a rolling shutter is only supported if shutter_close is 1 after shutter_open");
	expect_refused(VIEW(OPEN("0", "1")) "<shape type='sphere'><animation name='to_world'><transform time='0'/>"
					    "<transform time='1'><scale x='2'/></transform></animation></shape>",
		       "a sphere that moves may not be stretched in one direction");
	expect_refused(
		VIEW(OPEN("0", "1")) "<emitter type='sky'><animation name='to_world'>"
				     "<transform time='0'/><transform time='1'><rotate x='1' angle='9'/></transform>"
				     "</animation></emitter>",
		"motion of this plug-in is not supported");
	expect_refused(VIEW(OPEN("0", "1")) "<shape type='sphere'><animation name='to_world'><transform time='0'/>"
					    "<transform time='1'><scale y='2'/></transform></animation>"
					    "<emitter type='area'/></shape>",
		       "a sphere that moves may not be stretched in one direction");
	expect_environment_refused();
	expect_refused(
		VIEW(OPEN("0", "1")) "<emitter type='point'><animation name='to_world'><transform time='0'/>"
				     "<transform time='1'><translate x='1e30'/></transform></animation></emitter>",
		"it moves more than");
	expect_refused(VIEW(OPEN("0", "1")) "<shape type='cube' id='c'><animation name='to_world'><transform time='0'/>"
					    "<transform time='1'><translate x='2'/></transform></animation></shape>"
					    "<shape type='shapegroup' id='g'><ref id='c'/></shape>"
					    "<shape type='instance'><ref id='g'/></shape>",
		       "motion of a shape in a shapegroup is not supported");
	expect_refused(
		VIEW(OPEN(
			"0",
			"1")) "<shape type='cube'><animation name='to_world'><transform time='0'/>"
			      "<transform time='1'><scale value='5e59'/><translate x='9e59'/></transform></animation></shape>",
		"it moves beyond");
	/* clang-format off */
	expect_refused(
		VIEW(OPEN("0", "1"))
		"<shape type='cube'>"
			"<texture name='displacement' type='checkerboard'/>"
			"<integer name='displacement_level' value='1'/>"
			"<animation name='to_world'>"
				"<transform time='0'/>"
				"<transform time='1'><scale value='2'/></transform>"
			"</animation>"
		"</shape>",
		"a displaced shape that moves may not change its size");
	/* clang-format on */
}

/* The maximum number of keyframes in a file is read quickly, and only those that matter are kept. */
static void test_many_keyframes_are_read_quickly(void **state)
{
	(void)state;
	enum { KEYS = 100000 };
	size_t room = 200 * (size_t)KEYS, at = 0;
	char *xml = malloc(room);
	assert_non_null(xml);
	at += (size_t)snprintf(xml, room,
			       "<scene version='3.0.0'>" VIEW(OPEN("10", "99000")) SKY
			       "<shape type='cube'><animation name='to_world'>");
	for (int i = 0; i < KEYS; i++)
		at += (size_t)snprintf(xml + at, room - at,
				       "<transform time='%d'><rotate y='1' angle='%d'/><translate x='%g'/></transform>",
				       i, i * 50 % 360, i / 50000.0);
	at += (size_t)snprintf(xml + at, room - at, "</animation></shape></scene>");
	const struct memory_file files[] = {{"s.xml", xml, at}, {NULL, NULL, 0}};
	struct world *w = world_from_files(32, 32, files);
	assert_int_equal(w->shapes[0].placement->movement->motion.count, 99000 - 10 + 1);
	world_free(w);
	free(xml);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_equal_shutter_times_see_one_position),
		cmocka_unit_test(test_unsupported_motion_is_refused),
		cmocka_unit_test(test_many_keyframes_are_read_quickly),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
