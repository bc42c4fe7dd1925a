/* SPDX-License-Identifier: Apache-2.0 */
/* What leniency puts in the place of what is not supported: every stand-in is a plug-in of its class that there is. */
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/render.h"
#include "worker/render/scene/lenient.h"
#include "worker/render/scene/plugin.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void test_stand_ins(void **state)
{
	(void)state;
	static const struct {
		enum plugin_class cls;
		const char *type;
		enum lenient_way way;
		const char *stand_in;
	} expected[] = {
		{PLUGIN_BSDF, "hair", LENIENT_INNER, "diffuse"},
		{PLUGIN_BSDF, "measured", LENIENT_REPLACE, "roughplastic"},
		{PLUGIN_EMITTER, "timed_sunsky", LENIENT_REPLACE, "sunsky"},
		{PLUGIN_EMITTER, "collimated", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_RFILTER, "windowed", LENIENT_REPLACE, "gaussian"},
		{PLUGIN_TEXTURE, "wireframe", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_SHAPE, "ellipsoids", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_MEDIUM, "homogeneous", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_SENSOR, "fisheye", LENIENT_REFUSE, NULL},
		{PLUGIN_FILM, "specfilm", LENIENT_REPLACE, "hdrfilm"},
	};
	for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
		const char *stand_in;
		assert_int_equal(lenient_plugin(expected[i].cls, expected[i].type, &stand_in), expected[i].way);
		if (!expected[i].stand_in) {
			assert_null(stand_in);
			continue;
		}
		assert_string_equal(stand_in, expected[i].stand_in);
		const struct plugin_decl *d = plugin_find(render_plugins(), expected[i].cls, stand_in);
		assert_non_null(d);
		assert_string_equal(d->type, stand_in);
		assert_null(plugin_find(render_plugins(), expected[i].cls,
					expected[i].type)); /* or no stand-in is needed */
	}
}

static void test_colours_are_kept(void **state)
{
	(void)state;
	assert_string_equal(lenient_param("diffuse", "base_color"), "reflectance");
	assert_string_equal(lenient_param("diffuse", "diffuse_reflectance"), "reflectance");
	assert_string_equal(lenient_param("diffuse", "alpha"), "alpha");
	assert_string_equal(lenient_param("sunsky", "start_month"), "month");
	assert_string_equal(lenient_param("sunsky", "turbidity"), "turbidity");
	assert_string_equal(lenient_param("roughplastic", "diffuse_reflectance"), "diffuse_reflectance");
}

/* Covers go where they are not supported, and only there: what bsdf_create says of the same node. */
static void test_covers(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		bool goes;
	} covers[] = {
		{"coating | diffuse", false},
		{"coating | difftrans", true},
		{"twosided | polarizer", true},
		{"roughcoating | principledthin spec_trans=0.5", true},
		{"mask | diffuse", false},
		{"mask | difftrans", false},
		{"mask | thindielectric", false},
		{"mask | principledthin spec_trans=0.5 diff_trans=1", false},
		{"mask | dielectric", false},
		{"mask | principled spec_trans=0.5", false},
		{"coating | principled spec_trans=0.5", true},
		{"coating | principled spec_trans=0", false},
	};
	for (size_t i = 0; i < sizeof covers / sizeof *covers; i++) {
		struct arena a = {0};
		struct bsdf b;
		struct error e;
		bool goes = lenient_uncovered(bsdf_node(&a, covers[i].text)) != NULL,
		     refused = bsdf_try(&a, covers[i].text, true, &b, &e) < 0;
		if (goes != covers[i].goes || refused != covers[i].goes)
			fail_msg("%s is %ssupported and %s", covers[i].text, refused ? "not " : "",
				 goes ? "goes" : "stays");
		arena_fini(&a);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_stand_ins),
		cmocka_unit_test(test_colours_are_kept),
		cmocka_unit_test(test_covers),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
