/* SPDX-License-Identifier: Apache-2.0 */
/* Bump and normal maps that name their picture directly equal those that contain a raw texture of it. */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "worker/render/render.h"
#include "worker/render/scene/scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static int read_relief(struct scene *s, const char *version, const char *type, const char *picture, bool lenient,
		       struct error *e)
{
	char xml[1024];
	snprintf(xml, sizeof xml, "<scene version='%s'><bsdf type='%s'>%s<bsdf type='conductor'/></bsdf></scene>",
		 version, type, picture);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"a/n.png", "", 0}, {0}};
	const struct asset_source assets = memory_assets(files);
	return lenient ? scene_read_lenient(s, &assets, "s.xml", render_plugins(), NULL, 0, e)
		       : scene_read(s, &assets, "s.xml", render_plugins(), NULL, 0, e);
}

static struct scene read_valid(const char *version, const char *type, const char *picture)
{
	struct scene s;
	struct error e;
	if (read_relief(&s, version, type, picture, false, &e))
		fail_msg("%s %s %s: %s", version, type, picture, e.text);
	return s;
}

#define FILENAME(x) "<string name='filename' value='" x "'/>"
#define TEXTURE(x) "<texture type='bitmap'>" FILENAME(x) "<boolean name='raw' value='true'/></texture>"

static void test_file_name_stands_for_a_raw_texture(void **state)
{
	(void)state;
	static const char *const versions[] = {"0.6.0", "2.0.0", "3.0.0"};
	static const char *const types[] = {"normalmap", "bumpmap", "NormalMap"};
	for (size_t v = 0; v < 3; v++)
		for (size_t t = 0; t < 3; t++) {
			struct scene a = read_valid(versions[v], types[t], FILENAME("a/./n.png")),
				     b = read_valid(versions[v], types[t], TEXTURE("a/n.png"));
			assert_true(node_equals(a.objects[0], b.objects[0]));
			assert_non_null(node_child(a.objects[0], PLUGIN_TEXTURE, 0));
			assert_int_equal(a.asset_count, 1);
			assert_string_equal(a.assets[0], "a/n.png");
			scene_fini(&a);
			scene_fini(&b);
		}
}

static void test_other_forms_are_refused(void **state)
{
	(void)state;
	struct scene s;
	struct error e;
	assert_int_equal(read_relief(&s, "3.0.0", "normalmap", FILENAME("a/n.png") TEXTURE("a/n.png"), false, &e),
			 -EINVAL);
	assert_non_null(strstr(e.text, "a second texture"));
	assert_int_equal(read_relief(&s, "3.0.0", "twosided", FILENAME("a/n.png"), false, &e), -EINVAL);
	assert_non_null(strstr(e.text, "has no `filename`"));
	assert_int_equal(read_relief(&s, "3.0.0", "normalmap", "<string name='filename'/>", false, &e), -EINVAL);
	/* A picture whose file is missing. */
	assert_int_equal(read_relief(&s, "3.0.0", "normalmap", FILENAME("lost.png"), true, &e), 0);
	assert_string_equal(s.objects[0]->type, "conductor");
	assert_true(scene_has_note(&s, "<bsdf type=\"normalmap\"> has no texture left; the BSDF inside stands in"));
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_file_name_stands_for_a_raw_texture),
		cmocka_unit_test(test_other_forms_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
