/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Notes about cameras that see nothing, against rays: where the note appears, none of the camera's rays meets a
 * shape; and among random cameras none of whose 4,096 rays meets a shape, most get the note. Also scenes in which no
 * emitter gives light that is rendered.
 */
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"
#include "worker/render/geom/accel.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define NOTE "the camera sees no shape"
#define BALLS(x) "<shape type='sphere'><point name='center' x='" x "'/></shape><emitter type='constant'/>"
#define LOOK(t, more)                                                                             \
	"<sensor type='perspective'><transform name='to_world'><lookat origin='0,0,5' target='" t \
	"' up='0,1,0'/></transform>" more "</sensor>"

/* Finds the world's note about `subject`; "": none. */
static void find_note(const struct world *w, const char *subject, char note[1024])
{
	struct render_summary s;
	char sentence[1024];
	world_summary(w, &s);
	*note = 0;
	for (size_t i = 0; render_scene_note(&s, i, sentence, sizeof sentence); i++)
		if (strstr(sentence, subject))
			strcpy(note, sentence);
}

/* why: the expected note; "": none. */
static void assert_note(const char *text, const char *why)
{
	struct world *w = world_from_text(32, 32, "%s", text);
	char note[1024];
	find_note(w, NOTE, note);
	if (*why ? !strstr(note, why) : *note)
		fail_msg("of %s: '%s', not '%s'", text, note, why);
	world_free(w);
}

static void test_cameras_that_see_nothing_are_noted(void **state)
{
	(void)state;
	assert_note(LOOK("0,0,0", "") BALLS("0"), "");
	assert_note(LOOK("0,0,9", "") BALLS("0"), "all are behind it");
	assert_note(LOOK("9,0,5", "") BALLS("0"), "beside the image or behind it");
	assert_note(LOOK("0,0,0", "<float name='far_clip' value='3'/>") BALLS("0"), "beyond its far plane");
	assert_note(LOOK("0,0,0", "<float name='near_clip' value='7'/>") BALLS("0"), "nearer than its near plane");
	assert_note(LOOK("0,0,0", "<float name='far_clip' value='4.5'/>") BALLS("0"), "");
	assert_note(LOOK("0,0,0", "") "<emitter type='constant'/>", "");
	/* One visible shape suffices, wherever it stands in the list. */
	assert_note(LOOK("0,0,9", "") BALLS("0") "<shape type='sphere'><point name='center' z='9'/></shape>", "");
	/* The film's edge: a ball on the left is seen by the whole film, but not by a window on the right. */
	assert_note(LOOK("0,0,0", "<film type='hdrfilm'/>") BALLS("-2"), "");
	assert_note(LOOK("0,0,0", "<film type='hdrfilm'/>") BALLS("-9"), "beside");
	assert_note(LOOK("0,0,0", "<film type='hdrfilm'/>") BALLS("9"), "beside");
}

/* Returns whether one of n x n rays, from points all over the aperture, meets a shape. */
static bool meets_shape(const struct world *w, uint32_t n)
{
	const struct camera *c = &w->camera;
	for (uint32_t i = 0; i < n * n; i++) {
		double u[2] = {(i * 7 % n + 0.5) / n, (i / n * 5 % n + 0.5) / n}, low, high;
		struct ray_end from = {.p = camera_sample_point(c, u), .prim = PRIM_NONE};
		vec3 d = camera_direction(c, from.p, (i % n + 0.5) / n * c->width, (i / n + 0.5) / n * c->height);
		struct ray_hit hit;
		camera_clip_range(c, d, &low, &high);
		if (accel_closest(w->accel, &from, d, low, high, &hit))
			return true;
	}
	return false;
}

static void test_note_agrees_with_rays(void **state)
{
	(void)state;
	static const char *const kinds[] = {
		"<sensor type='perspective'><float name='fov' value='30'/>",
		"<sensor type='orthographic'>",
		("<sensor type='thinlens'><float name='aperture_radius' value='0.5'/>"
		 "<float name='focus_distance' value='3'/><float name='fov' value='20'/>"),
	};
	struct dice d = dice_for_test("cameras that see nothing");
	uint32_t blind = 0, noted = 0;
	for (size_t i = 0; i < 300; i++) {
		double x[9];
		for (int k = 0; k < 9; k++)
			x[k] = dice_between(&d, -4, 4);
		struct world *w = world_from_text(
			48, 32,
			"%s<transform name='to_world'><lookat origin='%g,%g,%g' target='0,0,%g' up='0,1,0'/></transform></sensor>"
			"<shape type='cube'><transform name='to_world'><scale value='0.3'/><translate x='%g' y='%g' z='%g'/>"
			"</transform></shape><shape type='sphere'><float name='radius' value='0.3'/><point name='center' x='%g' "
			"y='%g' z='%g'/></shape><emitter type='constant'/>",
			kinds[i % 3], x[0], x[1], 2 * x[2] + copysign(2, x[2]), x[3], x[4], x[5], x[6], x[7], x[8],
			-x[4]);
		char note[1024];
		find_note(w, NOTE, note);
		bool seen = meets_shape(w, 64);
		if (*note && seen)
			fail_msg("case %zu: a ray meets a shape, but '%s'", i, note);
		blind += !seen;
		noted += *note != 0;
		world_free(w);
	}
	print_message("of 300 cameras %u see nothing, and of %u this is said\n", blind, noted);
	assert_true(blind > 60 && noted > blind * 3 / 4 && blind < 240);
}

static void test_dark_scenes_are_noted(void **state)
{
	(void)state;
#define BALL(radiance) \
	"<shape type='sphere'><emitter type='area'><spectrum name='radiance' value='" radiance "'/></emitter></shape>"
	static const struct {
		const char *emitters;
		bool is_dark;
	} cases[] = {
		{"", false},
		{BALL("0"), true},
		{BALL("1"), false},
		{BALL("900:0.06, 1000:0.2"), true},
		{BALL("800:0.06, 1000:0.2"), false},
		{BALL("0") "<emitter type='constant'><spectrum name='radiance' value='100:1, 350:2'/></emitter>", true},
		{BALL("0") "<emitter type='constant'><rgb name='radiance' value='0, 0, 0.1'/></emitter>", false},
		{"<emitter type='point'><spectrum name='intensity' value='0'/></emitter>", true},
		{"<emitter type='directional'><spectrum name='irradiance' value='1e-9'/></emitter>", false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct world *w = world_from_text(32, 32, SENSOR("0,0,9", "0,0,0") "%s", cases[i].emitters);
		char note[1024];
		find_note(w, "no emitter gives light from 360 to 830 nm", note);
		if ((*note != 0) != cases[i].is_dark)
			fail_msg("%s: '%s'", cases[i].emitters, note);
		world_free(w);
	}
}

/* A shape so large that rays from the camera beside it drown in its rounding is named; one at a proper distance, or
 * with the camera beside it, is not. */
static void test_camera_beside_a_huge_shape_is_noted(void **state)
{
	(void)state;
#define WIDE(turn, size) \
	"<shape type='rectangle'><transform name='to_world'><scale value='" size "'/>" turn "</transform></shape>"
	static const struct {
		const char *shape;
		bool is_close;
	} cases[] = {
		{WIDE("", "1e16"), true},
		{WIDE("<rotate x='1' y='1' angle='40'/><translate z='4.5'/>", "1e16"), true},
		{"<shape type='sphere'><float name='radius' value='1e16'/><point name='center' z='-1e16'/></shape>",
		 true},
		{WIDE("", "1e9"), false},
		{WIDE("", "1"), false},
		{WIDE("<translate z='-1e10'/>", "1e16"), false},
		{WIDE("<translate x='1.1e16'/>", "1e16"), false},
		{WIDE("<translate z='5'/>", "1e16"), false}, /* the camera is in its plane */
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct world *w =
			world_from_text(32, 32, LOOK("0,0,0", "") "<emitter type='constant'/>%s", cases[i].shape);
		char note[1024];
		find_note(w, "the camera is too near to the ", note);
		if ((*note != 0) != cases[i].is_close)
			fail_msg("%s: '%s'", cases[i].shape, note);
		world_free(w);
	}
}

/* Negative pixels of an environment count as 0, with a note, whatever the others are. */
static void test_negative_pixels_of_environments_are_noted(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'>" SENSOR(
		"0,0,9", "0,0,0") "\n<emitter type='envmap'>"
				  "<string name='filename' value='sky.pfm'/></emitter></scene>";
	static const float pixels[3][6] = {{-1, -1, -1, 1, -2, 1}, {1, 1, 1, 0, -0.5f, 0}, {0, 1, 2, 3, 4, 5}};
	static const char *const said[] = {"scene.xml:2: 2 pixels of sky.pfm have a negative value, which counts as 0",
					   "scene.xml:2: 1 pixel of sky.pfm has a negative value, which counts as 0",
					   ""};
	for (int i = 0; i < 3; i++) {
		char pfm[64], note[1024];
		int head = snprintf(pfm, sizeof pfm, "PF\n2 1\n-1\n");
		memcpy(pfm + head, pixels[i], sizeof pixels[i]);
		const struct memory_file files[] = {{"scene.xml", xml, strlen(xml)},
						    {"sky.pfm", pfm, (size_t)head + sizeof pixels[i]},
						    {NULL, NULL, 0}};
		struct world *w = world_from_files(32, 32, files);
		find_note(w, "negative", note);
		assert_string_equal(note, said[i]);
		world_free(w);
	}
}

/* So do those of a texture, and of several images, but not those of a map of heights. */
static void test_negative_texels(void **state)
{
	(void)state;
#define PICTURE(name, file) \
	"\n<texture type='bitmap' name='" name "'><string name='filename' value='" file ".pfm'/></texture>"
#define SCENE(of_plane, of_sphere)                                                                   \
	"<scene version='3.0.0'>" SENSOR("0,0,9", "0,0,0") "<shape type='rectangle'>" of_plane       \
							   "</shape><shape type='sphere'>" of_sphere \
							   "</shape><emitter type='constant'/></scene>"
#define DIFFUSE(file) "<bsdf type='diffuse'>" PICTURE("reflectance", file) "</bsdf>"
	static const struct {
		const char *xml, *said;
	} cases[] = {
		{SCENE(DIFFUSE("bad"), DIFFUSE("good")),
		 "scene.xml:2: 1 pixel of bad.pfm has a negative value, which counts as 0"},
		{SCENE(DIFFUSE("good"), DIFFUSE("good")), ""},
		{SCENE(DIFFUSE("bad"), DIFFUSE("bad")),
		 "scene.xml:2: 1 pixel of bad.pfm has a negative value, which counts as 0"},
		{SCENE(DIFFUSE("bad"),
		       "<bsdf type='roughconductor'>" PICTURE("alpha", "worse") PICTURE("k", "bad") "</bsdf>"),
		 "scene.xml:2: 1 pixel of bad.pfm has a negative value, which counts as 0; other images have such pixels, too"},
		{SCENE("<bsdf type='bumpmap'>" PICTURE("height", "bad") "<bsdf type='diffuse'/></bsdf>", ""), ""},
	};
	static const float pixels[3][6] = {{0, 0.5f, 0, 1, 1, 1}, {0, 0.5f, 0, 1, -2, 1}, {-1, -1, -1, 1, -2, 1}};
	char pfm[3][64];
	int head = 0;
	for (int i = 0; i < 3; i++) {
		head = snprintf(pfm[i], sizeof pfm[i], "PF\n2 1\n-1\n");
		memcpy(pfm[i] + head, pixels[i], sizeof pixels[i]);
	}
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		const struct memory_file files[] = {{"scene.xml", cases[i].xml, strlen(cases[i].xml)},
						    {"good.pfm", pfm[0], (size_t)head + sizeof *pixels},
						    {"bad.pfm", pfm[1], (size_t)head + sizeof *pixels},
						    {"worse.pfm", pfm[2], (size_t)head + sizeof *pixels},
						    {NULL, NULL, 0}};
		struct world *w = world_from_files(32, 32, files);
		char note[1024];
		find_note(w, "negative", note);
		assert_string_equal(note, cases[i].said);
		world_free(w);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_cameras_that_see_nothing_are_noted),
		cmocka_unit_test(test_note_agrees_with_rays),
		cmocka_unit_test(test_dark_scenes_are_noted),
		cmocka_unit_test(test_negative_pixels_of_environments_are_noted),
		cmocka_unit_test(test_camera_beside_a_huge_shape_is_noted),
		cmocka_unit_test(test_negative_texels),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
