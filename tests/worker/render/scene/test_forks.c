/* SPDX-License-Identifier: Apache-2.0 */
/* Unknown parameters: those that forks of Mitsuba add are ignored with a note, and mistakes are refused. */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static int read_scene(const char *body, struct scene *s, struct error *e)
{
	char xml[512];
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", body);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	const struct asset_source assets = memory_assets(files);
	return scene_read(s, &assets, "s.xml", render_plugins(), NULL, 0, e);
}

/* Parameters of forks in objects of all classes, and directly in <scene>. */
static void test_parameters_of_forks_are_ignored(void **state)
{
	(void)state;
#define GUIDED "<boolean name='use_path_guiding' value='true'/>"
	static const char *const around[][3] = {
		{"", "", "s.xml:1: <boolean>: `use_path_guiding` is ignored"},
		{"<bsdf type='diffuse'>", "</bsdf>", "<bsdf type=\"diffuse\">: "},
		{"<bsdf type='mask'><bsdf type='diffuse'>", "</bsdf></bsdf>", "<bsdf type=\"diffuse\">: "},
		{"<texture id='t' type='checkerboard'>", "</texture>", "<texture type=\"checkerboard\">: "},
		{"<medium type='homogeneous'>", "</medium>", "<medium type=\"homogeneous\">: "},
		{"<medium type='homogeneous'><phase type='hg'>", "</phase></medium>", "<phase type=\"hg\">: "},
		{"<emitter type='constant'>", "</emitter>", "<emitter type=\"constant\">: "},
		{"<sensor type='perspective'><film type='hdrfilm'><rfilter type='box'>", "</rfilter></film></sensor>",
		 "<rfilter type=\"box\">: "},
		{"<shape type='cube'>", "</shape>", "<shape type=\"cube\">: "},
	};
	for (size_t i = 0; i < sizeof around / sizeof *around; i++) {
		char body[384];
		struct scene s;
		struct error e;
		snprintf(body, sizeof body, "%s" GUIDED "%s", around[i][0], around[i][1]);
		if (read_scene(body, &s, &e))
			fail_msg("%s: %s", body, e.text);
		if (!scene_has_note(&s, around[i][2]) || !scene_has_note(&s, "`use_path_guiding`"))
			fail_msg("%s: not \"%s\"", body, around[i][2]);
		scene_fini(&s);
	}
#undef GUIDED
}

/* Mistakes: a name that resembles a parameter of this plug-in or of another one; and objects, which affect the image.
 */
static void test_mistyped_parameters_and_objects_are_refused(void **state)
{
	(void)state;
	static const char *const mistakes[][2] = {
		{"<bsdf type='diffuse'><float name='reflectence' value='1'/></bsdf>", "did you mean `reflectance`?"},
		{"<bsdf type='diffuse'><float name='albedo' value='1'/></bsdf>", "did you mean `reflectance`?"},
		{"<bsdf type='plastic'><float name='ior' value='1.3'/></bsdf>", "did you mean `int_ior`?"},
		{"<bsdf type='roughconductor'><float name='roughness' value='1'/></bsdf>", "did you mean `alpha`?"},
		{"<bsdf type='conductor'><float name='diffuseReflectance' value='1'/></bsdf>",
		 "no `diffuseReflectance`"},
		{"<bsdf type='roughplastic'><float name='alpha_scale' value='1'/></bsdf>", "did you mean `alpha`?"},
		{"<texture id='t' type='checkerboard'><float name='color2' value='1'/></texture>", "mean `color0`?"},
		{"<bsdf type='diffuse'><texture name='guide' type='checkerboard'/></bsdf>", "has no `guide`"},
		{"<bsdf type='diffuse'><bsdf name='guide' type='diffuse'/></bsdf>", "has no `guide`"},
		{"<bsdf type='twosided'><bsdf type='difuse'/></bsdf>", "did you mean `diffuse`?"},
		{"<integer name='max_depth' value='3'/>", "has no place in <scene>"},
	};
	for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++) {
		struct scene s;
		struct error e;
		assert_true(read_scene(mistakes[i][0], &s, &e) < 0);
		if (!strstr(e.text, mistakes[i][1]))
			fail_msg("%s: without \"%s\"", e.text, mistakes[i][1]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_parameters_of_forks_are_ignored),
		cmocka_unit_test(test_mistyped_parameters_and_objects_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
