/* SPDX-License-Identifier: Apache-2.0 */
/* The camera in an image's header, against the camera of a scene written from this header. */
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define FILM                                                                                                 \
	"<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' value='8'/><rfilter " \
	"type='box'/></film>"
#define LOOK "<transform name='to_world'><lookat origin='1,2,5' target='0.5,0,0' up='0,1,0'/></transform>"
#define BALL "<shape type='sphere'/><emitter type='constant'/>"

static void read_camera(const char *sensor, char text[RENDER_CAMERA_TEXT_MAX], mat4 *m)
{
	struct world *w = world_from_text(16, 8, "%s%s", sensor, BALL);
	struct render_summary s;
	world_summary(w, &s);
	render_camera_text(&s, text, RENDER_CAMERA_TEXT_MAX);
	*m = s.settings.to_world;
	world_free(w);
}

static void expect_part(const char *text, const char *part)
{
	if (!strstr(text, part))
		fail_msg("\"%s\" does not say \"%s\"", text, part);
}

static void test_text_describes_the_camera(void **state)
{
	(void)state;
	char text[RENDER_CAMERA_TEXT_MAX];
	mat4 m;
	read_camera(
		"<sensor type='perspective'><float name='fov' value='40'/><string name='fov_axis' value='y'/>" LOOK FILM
		"</sensor>",
		text, &m);
	assert_true(strncmp(text, "perspective fov=40 fov_axis=y near_clip=", 40) == 0);
	const char *at = strstr(text, " to_world=");
	assert_non_null(at);
	at += strlen(" to_world=");
	for (int i = 0; i < 16; i++) {
		char *end;
		double x = strtod(at, &end), want = m.m[i / 4][i % 4];
		if (!(fabs(x - want) <= 1e-8 * fabs(want)) || *end != (i < 15 ? ',' : 0))
			fail_msg("%s: %.12g is not %.12g", text, x, want);
		at = end + 1;
	}
	assert_true(m.m[0][3] == 1 && m.m[1][3] == 2 && m.m[2][3] == 5);
	read_camera("<sensor type='thinlens'><float name='fov' value='30'/><float name='aperture_radius' value='0.25'/>"
		    "<float name='focus_distance' value='4'/>" LOOK FILM "</sensor>",
		    text, &m);
	assert_true(strncmp(text, "thinlens fov=30 fov_axis=x aperture_radius=0.25 focus_distance=4 ", 65) == 0);
	read_camera("", text, &m); /* a ball of radius 1 at the origin, entirely in view */
	assert_true(strncmp(text, "perspective fov=45 fov_axis=x ", 30) == 0);
	assert_true(fabs(m.m[2][3] + 1 + 1 / tan(M_PI / 8)) < 1e-9);
	read_camera("<sensor type='orthographic'>" LOOK FILM "</sensor>", text, &m);
	expect_part(text, "orthographic half_width=1 near_clip=");
	read_camera("<sensor type='perspective'><float name='fov' value='40'/><float name='principal_point_offset_x' "
		    "value='0.25'/>" LOOK FILM "</sensor>",
		    text, &m);
	expect_part(text, " principal_point_offset_x=0.25 principal_point_offset_y=0 ");
}

static void check_note(const char *scene, bool dark)
{
	struct world *w = world_from_text(16, 8, "%s", scene);
	struct render_summary s;
	char text[512];
	world_summary(w, &s);
	assert_true(render_scene_note(&s, 0, text, sizeof text));
	expect_part(text, "the scene has no <sensor>");
	assert_int_equal(strstr(text, "the image is black") != NULL, dark);
	world_free(w);
}

static void test_default_camera_is_noted(void **state)
{
	(void)state;
	check_note(BALL, false);
	check_note("<shape type='sphere'/>", true);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_text_describes_the_camera),
					   cmocka_unit_test(test_default_camera_is_noted)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
