/* SPDX-License-Identifier: Apache-2.0 */
/* Reflectances above 1 are refused with their place; with `lenient` they count as 1, with a note. */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "worker/render/render.h"
#include "worker/render/scene/value.h"
#include "worker/render/texture/texture.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static char xml[2048];

static int read_scene(const char *version, const char *body, bool lenient, struct scene *s, struct error *e)
{
	snprintf(xml, sizeof xml, "<scene version='%s'>\n%s\n</scene>", version, body);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	const struct asset_source assets = memory_assets(files);
	return (lenient ? scene_read_lenient : scene_read)(s, &assets, "s.xml", render_plugins(), NULL, 0, e);
}

static struct scene read_leniently(const char *version, const char *body)
{
	struct scene s;
	struct error e;
	if (read_scene(version, body, true, &s, &e))
		fail_msg("%s", e.text);
	return s;
}

static void expect_refused(const char *version, const char *body, bool lenient, const char *why)
{
	struct scene s;
	struct error e;
	assert_int_equal(read_scene(version, body, lenient, &s, &e), -ERANGE);
	if (!strstr(e.text, why))
		fail_msg("%s: without \"%s\"", e.text, why);
}

#define DIFFUSE(value) "<bsdf type='diffuse' id='b'>" value "</bsdf>"

static void test_values_above_one_are_clipped(void **state)
{
	(void)state;
	static const struct {
		const char *body, *note;
		double clipped[3];
	} cases[] = {
		{DIFFUSE("<float name='reflectance' value='1.1'/>"), "reflectance=1.1", {1}},
		{DIFFUSE("<integer name='reflectance' value='3'/>"), "reflectance=3", {1}},
		{DIFFUSE("<rgb name='reflectance' value='0.25,1.5,2'/>"), "reflectance=2", {0.25, 1, 1}},
		{DIFFUSE("<spectrum name='reflectance' value='400:1.25,500:0.5,700:0.75'/>"),
		 "reflectance=1.25",
		 {1, 0.5, 0.75}},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char note[160];
		uint32_t count;
		expect_refused("3.0.0", cases[i].body, false, "; --lenient counts it as 1");
		expect_refused("3.0.0", cases[i].body, false, "s.xml:2: <");
		struct scene s = read_leniently("3.0.0", cases[i].body);
		snprintf(note, sizeof note, "s.xml:2: <bsdf type=\"diffuse\">: %s is above 1 and counts as 1 (lenient)",
			 cases[i].note);
		assert_true(scene_has_note(&s, note));
		const struct property *p = node_find_property(scene_find_object(&s, "b"), "reflectance");
		double room[3];
		const double *x = value_numbers(&p->value, room, &count);
		for (uint32_t k = 0; k < count; k++)
			assert_true(x[k] == cases[i].clipped[k]);
		scene_fini(&s);
	}
	struct scene s =
		read_leniently("3.0.0", "<bsdf type='principled' id='b'><float name='roughness' value='1.2'/></bsdf>");
	assert_true(node_float(scene_find_object(&s, "b"), "roughness", 0) == 1);
	scene_fini(&s);
}

/* Values that are invalid in another way stay errors, and so do values beyond ranges that do not end at 1. */
static void test_other_invalid_values_stay_errors(void **state)
{
	(void)state;
	expect_refused("3.0.0", DIFFUSE("<float name='reflectance' value='-0.1'/>"), true,
		       "reflectance=-0.1 is outside [0, 1]");
	expect_refused("3.0.0", DIFFUSE("<rgb name='reflectance' value='2,-1,0'/>"), true, "is outside [0, 1]");
	expect_refused("3.0.0", "<bsdf type='roughconductor'><float name='alpha' value='11'/></bsdf>", true,
		       "is outside [0, 10]");
}

/* The same texture is used as a height of 2 and as a reflectance of 1. */
static void test_texture_is_clipped_only_as_reflectance(void **state)
{
	(void)state;
	static const char body[] =
		"<texture type='checkerboard' id='t'><float name='color0' value='2'/>\n"
		"<texture type='gridtexture' name='color1'><float name='color0' value='0.5'/>"
		"<rgb name='color1' value='3,0.25,0'/></texture></texture>"
		"<bsdf type='bumpmap' id='b'><ref id='t'/><bsdf type='diffuse'><ref name='reflectance' id='t'/></bsdf></bsdf>"
		"<bsdf type='phong' id='p'><ref name='exponent' id='t'/></bsdf>";
	for (int version = 0; version < 2; version++) {
		expect_refused(
			version ? "3.0.0" : "0.6.0", body, false,
			"s.xml:2: <texture type=\"checkerboard\">: color0=2 is above 1, which no reflectance can be; "
			"--lenient counts it as 1");
		struct scene s = read_leniently(version ? "3.0.0" : "0.6.0", body);
		assert_true(scene_has_note(
			&s, "s.xml:2: <texture type=\"checkerboard\">: color0=2 is above 1 and counts as 1 (lenient)"));
		assert_true(scene_has_note(
			&s, "s.xml:3: <texture type=\"gridtexture\">: color1=3 is above 1 and counts as 1 (lenient)"));
		const struct scene_node *bump = scene_find_object(&s, "b"),
					*t = node_ref(node_child(bump, PLUGIN_BSDF, 0), "reflectance");
		assert_true(node_float(t, "color0", 0) == 1);
		const double *rgb = node_find_property(node_ref(t, "color1"), "color1")->value.as.rgb;
		assert_true(rgb[0] == 1 && rgb[1] == 0.25 && rgb[2] == 0);
		assert_true(node_float(node_child(bump, PLUGIN_TEXTURE, 0), "color0", 0) == 2);
		assert_true(node_float(node_ref(scene_find_object(&s, "p"), "exponent"), "color0", 0) == 2);
		struct error e;
		struct texture made;
		struct arena a = {0};
		const struct texture_build build = {.arena = &a, .is_dialect_3 = version};
		assert_int_equal(texture_create(&made, t, COLOR_REFLECTANCE, &build, &e), 0);
		assert_true(texture_max(&made) <= 1);
		arena_fini(&a);
		scene_fini(&s);
	}
}

static void test_shared_texture_is_refused_once(void **state)
{
	(void)state;
	static const char text[] =
		"<scene version='3.0.0'><texture type='checkerboard' id='t'><float name='color0' value='2'/>"
		"</texture><bsdf type='diffuse'><ref name='reflectance' id='t'/></bsdf>"
		"<bsdf type='plastic'><ref name='diffuse_reflectance' id='t'/></bsdf></scene>";
	const struct memory_file files[] = {{"s.xml", text, strlen(text)}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read_all(&s, &assets, "s.xml", render_plugins(), NULL, 0, false, &e), 0);
	assert_int_equal(s.problem_count, 1);
	scene_fini(&s);
}

/* Many materials that share a texture with many numbers share the clipped copy, too. */
static void test_materials_share_the_clipped_copy(void **state)
{
	(void)state;
	struct scene s =
		read_leniently("3.0.0", "<texture type='checkerboard' id='t'><float name='color0' value='2'/></texture>"
					"<bsdf type='diffuse' id='b'><ref name='reflectance' id='t'/></bsdf>"
					"<bsdf type='plastic' id='p'><ref name='diffuse_reflectance' id='t'/></bsdf>");
	const struct scene_node *one = node_ref(scene_find_object(&s, "b"), "reflectance");
	assert_true(node_float(one, "color0", 0) == 1);
	assert_ptr_equal(one, node_ref(scene_find_object(&s, "p"), "diffuse_reflectance"));
	scene_fini(&s);
}

/* Mitsuba 0.6 scales reflectances; `lenient` applies only to values that 0.6 does not scale. */
static void test_values_above_one_are_scaled_in_old_files(void **state)
{
	(void)state;
	struct scene s = read_leniently("0.6.0", DIFFUSE("<float name='reflectance' value='2'/>"));
	assert_true(node_float(scene_find_object(&s, "b"), "reflectance", 0) == 0.99);
	scene_fini(&s);
	s = read_leniently("0.6.0", "<bsdf type='diffuse' id='b'><float name='reflectance' value='2'/>"
				    "<boolean name='ensureEnergyConservation' value='false'/></bsdf>");
	assert_true(node_float(scene_find_object(&s, "b"), "reflectance", 0) == 1);
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_values_above_one_are_clipped),
		cmocka_unit_test(test_other_invalid_values_stay_errors),
		cmocka_unit_test(test_texture_is_clipped_only_as_reflectance),
		cmocka_unit_test(test_shared_texture_is_refused_once),
		cmocka_unit_test(test_materials_share_the_clipped_copy),
		cmocka_unit_test(test_values_above_one_are_scaled_in_old_files),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
