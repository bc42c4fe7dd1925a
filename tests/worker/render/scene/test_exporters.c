/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scenes in the form in which exporters write them, with the parameters that they write by default
 * (tests/scenes/exporters): each is read without a problem. Taken from the exporters' sources; see
 * tests/corpus/README.md.
 */
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"
#include "worker/render/scene/scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void test_exported_scenes_are_read(void **state)
{
	(void)state;
	static const char *const scenes[] = {"blender-0.5.xml", "blender-3.xml", "rhino.xml", "maya.xml"};
	struct asset_source assets = asset_source_for_folder("tests/scenes/exporters");
	for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
		struct scene s;
		struct error e;
		if (scene_read_all(&s, &assets, scenes[i], render_plugins(), NULL, 0, false, &e))
			fail_msg("%s: %s", scenes[i], e.text);
		for (uint32_t k = 0; k < s.problem_count; k++)
			print_error("%s: %s\n", scenes[i], s.problems[k]);
		assert_int_equal(s.problem_count, 0);
		scene_fini(&s);
	}
}

/* Attributes of <scene> besides the version: those that Mitsuba allows and those that XML editors add, also in
 * included files. */
static void test_extra_attributes_of_the_root_are_accepted(void **state)
{
	(void)state;
	static const char *const roots[] = {
		"<scene version='3.0.0' type='scene' id='all' name='whole'>",
		"<scene xmlns:xi='http://www.w3.org/2001/XInclude' version='3.0.0' xmlns='x'>",
		"<scene version='0.6.0' id='all' xmlns:xsi='x' xsi:noNamespaceSchemaLocation='s.xsd'>",
	};
	for (size_t i = 0; i < sizeof roots / sizeof *roots; i++) {
		char inner[256];
		snprintf(inner, sizeof inner, "%s<bsdf type='diffuse' id='all'/></scene>", roots[i]);
		char outer[256];
		snprintf(outer, sizeof outer, "%s<include filename='i.xml'/></scene>", roots[i]);
		const struct memory_file files[] = {
			{"s.xml", outer, strlen(outer)}, {"i.xml", inner, strlen(inner)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s: %s", roots[i], e.text);
		assert_int_equal(s.object_count, 1);
		assert_string_equal(s.objects[0]->id, "all");
		assert_int_equal(s.note_count, 0);
		scene_fini(&s);
	}
}

/* Malformed XML that Mitsuba 3's reader accepts; a stray letter gets a note. */
static void test_malformed_xml_of_exporters_is_accepted(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		uint32_t notes;
	} cases[] = {
		{"\n\n <?xml version='1.0'?>\n<scene version='3.0.0'><bsdf type='diffuse' id='a &  b'/></scene>", 0},
		{"<!-- -- x -- --><scene version='3.0.0'><bsdf type='diffuse' id='a'/></scene>", 0},
		{"<scene version='3.0.0'><bsdf type='diffuse' id='a'/>/> x</scene>", 1},
		{"<scene version='3.0.0'><bsdf type='diffuse' id='a'><rgb name='reflectance' value=', .1,.2, .3 , '/></bsdf></scene>",
		 0},
		{"<?xml version='1.0'?><!DOCTYPE scene SYSTEM '/there/is/none.dtd'>"
		 "<scene version='0.6.0'><bsdf type='diffuse' id='a'/></scene>",
		 0},
		{"<scene version='3.0.0'><bsdf type='diffuse' id='a'/></scene>\n<scene version='3.0.0'>"
		 "<bsdf type='unheard'/>",
		 1},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		const struct memory_file files[] = {{"s.xml", cases[i].text, strlen(cases[i].text)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%zu: %s", i, e.text);
		assert_int_equal(s.object_count, 1);
		assert_int_equal(s.note_count, cases[i].notes);
		scene_fini(&s);
	}
}

/* The note about several root elements names the file, which may be an included one, once. */
static void test_several_root_elements_are_noted_once(void **state)
{
	(void)state;
	static const char outer[] =
		"<scene version='3.0.0'><include filename='i.xml'/><include filename='j.xml'/></scene>",
			  inner[] = "<bsdf type='diffuse' version='3.0.0'/><x/>";
	static const struct memory_file files[] = {{"s.xml", outer, sizeof outer - 1},
						   {"i.xml", inner, sizeof inner - 1},
						   {"j.xml", inner, sizeof inner - 1},
						   {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_int_equal(s.object_count, 2);
	assert_int_equal(s.note_count, 1);
	assert_string_equal(s.notes[0], "s.xml: what follows the first element of i.xml is ignored, as by Mitsuba 3");
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_exported_scenes_are_read),
					   cmocka_unit_test(test_extra_attributes_of_the_root_are_accepted),
					   cmocka_unit_test(test_malformed_xml_of_exporters_is_accepted),
					   cmocka_unit_test(test_several_root_elements_are_noted_once)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
