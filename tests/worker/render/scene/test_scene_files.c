/* SPDX-License-Identifier: Apache-2.0 */
/* The list of a scene's files: each file once and in order, under one canonical name, however the scene writes it. */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_tables.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static struct memory_file files[4];

static int read_with_defines(struct scene *s, const char *xml, const struct scene_define *defines, size_t n,
			     struct error *e)
{
	files[0] = (struct memory_file){"s.xml", xml, strlen(xml)};
	struct asset_source assets = memory_assets(files);
	return scene_read(s, &assets, "s.xml", scene_tables(), defines, n, e);
}

static struct scene read_valid(const char *xml)
{
	struct scene s;
	struct error e;
	if (read_with_defines(&s, xml, NULL, 0, &e))
		fail_msg("%s", e.text);
	return s;
}

static void test_assets_are_sorted_and_unique(void **state)
{
	(void)state;
	struct scene s = read_valid(
		"<scene version='3.0.0'>"
		"<shape type='obj'><string name='filename' value='b.obj'/></shape>"
		"<shape type='obj'><string name='filename' value='a.obj'/></shape>"
		"<shape type='obj'><string name='filename' value='b.obj'/></shape>"
		"<sensor type='perspective'><film type='hdrfilm'><string name='filename' value='out.exr'/></film></sensor>"
		"</scene>");
	assert_int_equal(s.asset_count, 2);
	assert_string_equal(s.assets[0], "a.obj");
	assert_string_equal(s.assets[1], "b.obj");
	scene_fini(&s);
}

/* However a file is named, it is one file, whose canonical name has no "..". */
static void test_asset_names_are_canonical(void **state)
{
	(void)state;
	static const char *const names[] = {"%2e%2e/common/a.obj", "%2e%2e/common/b.ply", "inc.xml", "m/c.obj"};
	files[1] = (struct memory_file){"inc.xml", "<scene version='3.0.0'/>", 24};
	struct scene s = read_valid("<scene version='3.0.0'><include filename='x/../inc.xml'/>"
				    "<shape type='obj'><string name='filename' value='../common/a.obj'/></shape>"
				    "<shape type='obj'><string name='filename' value='m/../../common//a.obj'/></shape>"
				    "<shape type='ply'><string name='filename' value='./../common/x/../b.ply'/></shape>"
				    "<shape type='obj'><string name='filename' value='./m/c.obj'/></shape></scene>");
	assert_int_equal(s.asset_count, 4);
	for (uint32_t i = 0; i < 4; i++)
		assert_string_equal(s.assets[i], names[i]);
	assert_string_equal(node_string(s.objects[0], "filename", ""), names[0]);
	assert_string_equal(node_string(s.objects[3], "filename", ""), names[3]);
	scene_fini(&s);
	/* a search path outside the scene's folder */
	files[1] = (struct memory_file){"%2e%2e/common/a.obj", "x", 1};
	s = read_valid("<scene version='3.0.0'><path value='m/../../common/'/>"
		       "<shape type='obj'><string name='filename' value='a.obj'/></shape></scene>");
	assert_int_equal(s.asset_count, 1);
	assert_string_equal(s.assets[0], names[0]);
	assert_int_equal(s.note_count, 0);
	scene_fini(&s);
	/* a name from Windows; a name that exists as it is written; and one that does not exist */
	s = read_valid("<scene version='3.0.0'><path value='m/../../common/'/>"
		       "<shape type='obj'><string name='filename' value='..\\common\\a.obj'/></shape>"
		       "<shape type='obj'><string name='filename' value='x\\..\\a.obj'/></shape>"
		       "<shape type='obj'><string name='filename' value='b\\c.obj'/></shape></scene>");
	assert_string_equal(node_string(s.objects[0], "filename", ""), names[0]);
	assert_string_equal(node_string(s.objects[1], "filename", ""), names[0]);
	assert_string_equal(node_string(s.objects[2], "filename", ""), "b\\c.obj");
	scene_fini(&s);
	files[1].name = "b\\c.obj";
	s = read_valid(
		"<scene version='3.0.0'><shape type='obj'><string name='filename' value='b\\c.obj'/></shape></scene>");
	assert_string_equal(node_string(s.objects[0], "filename", ""), "b\\c.obj");
	files[1] = (struct memory_file){0};
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_assets_are_sorted_and_unique),
		cmocka_unit_test(test_asset_names_are_canonical),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
