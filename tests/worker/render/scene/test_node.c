/* SPDX-License-Identifier: Apache-2.0 */
/* Comparison of nodes, and the names by which error messages refer to them. */
#include "common/base/text.h"
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"

#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* Equal objects, and the same objects with one word changed. */
static void test_equal_objects_are_recognised(void **state)
{
	(void)state;
	static const char format[] =
		"<scene version='3.0.0'><texture type='scale' id='a'>%s<float name='scale' value='2'/></texture>"
		"<texture type='scale' id='b'><float name='scale' value='2'/>%s</texture></scene>";
#define PICTURE(inside) "<texture type='bitmap'>" inside "</texture>"
#define FILE_NAME(name) "<string name='filename' value='" name "'/>"
#define RAW(yes) "<boolean name='raw' value='" yes "'/>"
#define MAP(x) "<transform name='to_uv'><scale x='" x "'/></transform>"
#define TILES(color) "<texture type='checkerboard'>" color "</texture>"
	static const struct {
		const char *a, *b;
		bool is_equal;
	} all[] = {
		{PICTURE(FILE_NAME("p.png") RAW("true") MAP("2")), PICTURE(MAP("2") RAW("true") FILE_NAME("p.png")),
		 true},
		{PICTURE(FILE_NAME("p.png")), PICTURE(FILE_NAME("q.png")), false},
		{PICTURE(FILE_NAME("p.png") RAW("true")), PICTURE(FILE_NAME("p.png") RAW("false")), false},
		{PICTURE(FILE_NAME("p.png") RAW("true")), PICTURE(FILE_NAME("p.png")), false},
		{PICTURE(FILE_NAME("p.png")), PICTURE(FILE_NAME("p.png") RAW("true")), false},
		{PICTURE(FILE_NAME("p.png") MAP("2")), PICTURE(FILE_NAME("p.png") MAP("3")), false},
		{TILES("<rgb name='color0' value='1,0,1'/>"), TILES("<rgb name='color0' value='1,0,1'/>"), true},
		{TILES("<rgb name='color0' value='1,0,1'/>"), TILES("<rgb name='color0' value='1,0,0'/>"), false},
		{TILES("<rgb name='color0' value='1,0,1'/>"), TILES("<rgb name='color1' value='1,0,1'/>"), false},
		{TILES("<float name='color0' value='1'/>"), TILES("<integer name='color0' value='1'/>"), false},
		{TILES("<spectrum name='color0' value='400:0.5,700:1'/>"),
		 TILES("<spectrum name='color0' value='400:0.5,700:1'/>"), true},
		{TILES("<spectrum name='color0' value='400:0.5,700:1'/>"),
		 TILES("<spectrum name='color0' value='400:0.5,600:1'/>"), false},
		{TILES("<spectrum name='color0' value='400:0.5,700:1'/>"),
		 TILES("<spectrum name='color0' value='400:0.5,700:0.9'/>"), false},
		{TILES(""), "<texture type='gridtexture'/>", false},
	};
	for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
		struct scene s;
		struct error e;
		char xml[1024];
		int n = snprintf(xml, sizeof xml, format, all[i].a, all[i].b);
		assert_true(n > 0 && (size_t)n < sizeof xml);
		const struct memory_file pictures[] = {
			{"s.xml", xml, (size_t)n}, {"p.png", "", 0}, {"q.png", "", 0}, {NULL, NULL, 0}};
		struct asset_source assets = memory_assets(pictures);
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s", e.text);
		if (node_equals(s.objects[0], s.objects[1]) != all[i].is_equal)
			fail_msg("%s and %s", all[i].a, all[i].b);
		scene_fini(&s);
	}
}

/* A long name is shortened to its end, which differs between the files of a scene. */
static void test_places_in_long_file_names_are_shortened(void **state)
{
	(void)state;
	char text[NODE_TITLE_MAX], place[NODE_PLACE_MAX];
	struct scene_node n = {.cls = PLUGIN_SHAPE, .type = "sphere", .file = "room.xml", .line = 7};
	assert_string_equal(node_place(&n, place), "room.xml:7");
	assert_string_equal(node_title(&n, text), "the sphere in room.xml:7");
	n.id = "lamp";
	n.line = INT_MAX;
	n.file = "0123456789/0123456789/0123456789/0123456789/lamps.xml";
	assert_string_equal(node_title(&n, text),
			    "`lamp` (...56789/0123456789/0123456789/0123456789/lamps.xml:2147483647)");
	/* names are cut between whole characters: JSON and the wire format take valid UTF-8 only */
	static const char e[] =
		"\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9"
		"\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9\u00e9";
	char id[80], file[80];
	n.id = id;
	n.file = file;
	for (int shift = 0; shift < 2; shift++) {
		snprintf(id, sizeof id, "%s%s", shift ? "x" : "", e);
		snprintf(file, sizeof file, "%s%s", e, shift ? "x" : "");
		if (!text_is_clean(node_title(&n, text)))
			fail_msg("%s is cut within a character", text);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_equal_objects_are_recognised),
					   cmocka_unit_test(test_places_in_long_file_names_are_shortened)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
