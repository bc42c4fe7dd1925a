/* SPDX-License-Identifier: Apache-2.0 */
/* Parameters that change light slightly and are not supported: a note names each one, but not if the file sets it to
 * off. Also unknown parameters, and values that are read as others. */
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

#define BENT(type, name, value)                                                                                   \
	"<bsdf type='" type "'><texture name='t' type='checkerboard'/><bsdf type='diffuse'/><boolean name='" name \
	"' value='" value "'/></bsdf>"

/* note: expected note; NULL: no note about visible differences */
static void check_note(const char *inside, const char *note)
{
	char xml[1024];
	struct scene s;
	struct error e;
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", inside);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"e.png", "", 0}, {0}};
	struct asset_source assets = memory_assets(files);
	if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s: %s", inside, e.text);
	static const char *const unwanted[] = {"not supported", "limits paths", "not known", "is read as"};
	if (note && !scene_has_note(&s, note))
		fail_msg("%s: %s", inside, note);
	for (size_t i = 0; !note && i < sizeof unwanted / sizeof *unwanted; i++)
		if (scene_has_note(&s, unwanted[i]))
			fail_msg("%s: a note too many: %s", inside, unwanted[i]);
	scene_fini(&s);
}

static void test_unsupported_parameters_are_noted(void **state)
{
	(void)state;
	check_note("<emitter type='sky'><rgb name='albedo' value='1 0 0'/></emitter>", NULL);
	check_note("<emitter type='sky'/>", NULL);
	check_note(BENT("bumpmap", "flip_invalid_normals", "true"), NULL);
	check_note(BENT("bumpmap", "use_shadowing_function", "true"), NULL);
	check_note("<emitter type='directional'><float name='angle' value='0.53'/></emitter>",
		   "`angle` is not supported: the image differs a little from Mitsuba's");
	check_note("<emitter type='directional'><float name='angle' value='0.0'/></emitter>", NULL);
	check_note("<shape type='sphere'><medium type='homogeneous'/></shape>",
		   "s.xml:1: a medium in a shape is ignored");
	check_note(
		"<bsdf type='normalmap'><rgb name='normalmap' value='0.9,0.5,0.75'/><bsdf type='twosided'>"
		"<bsdf type='bumpmap'><boolean name='flip_invalid_normals' value='true'/><texture type='checkerboard'/>"
		"<bsdf type='diffuse'/></bsdf></bsdf></bsdf>",
		"s.xml:1: <bsdf type=\"normalmap\">: flip_invalid_normals has no effect on maps inside others");
	check_note("<shape type='sphere'><medium type='homogeneous' name='inner'/></shape>",
		   "s.xml:1: a medium in a shape is ignored");
	check_note("<medium type='homogeneous' id='m'/><shape type='sphere'><ref id='m'/></shape>",
		   "s.xml:1: a medium in a shape is ignored");
}

/* The ignored parameters of an object share a note, one for each kind; a second film's note adds those that the first
 * film did not have. */
static void test_ignored_parameters_share_a_note(void **state)
{
	(void)state;
	/* clang-format off */
	static const char xml[] =
		"<scene version='0.6.0'>\n"
			"<sensor type='perspective'><float name='focusDistance' value='1'/>\n"
				"<film type='hdrfilm'>"
					"<boolean name='banner' value='false'/>\n"
					"<string name='pixelFormat' value='rgb'/>"
					"<string name='fork' value='x'/>\n"
					"<string name='componentFormat' value='float16'/>"
				"</film>"
			"</sensor>\n"
			"<sensor type='perspective'>"
				"<film type='hdrfilm'>"
					"<string name='pixelFormat' value='rgb'/>\n"
					"<string name='fileFormat' value='openexr'/>"
				"</film>"
			"</sensor>"
		"</scene>";
	/* clang-format on */
	static const char *const notes[] = {
		"s.xml:2: <sensor type=\"perspective\">: `focusDistance` has no effect on light and is ignored",
		("s.xml:3: <film type=\"hdrfilm\">: `banner`, `pixelFormat`, `componentFormat` have no effect on light and "
		 "are ignored"),
		"s.xml:4: <film type=\"hdrfilm\">: `fork` is not known and is ignored",
		"s.xml:7: <film type=\"hdrfilm\">: `fileFormat` has no effect on light and is ignored"};
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	for (size_t i = 0; i < sizeof notes / sizeof *notes; i++)
		if (!scene_has_note(&s, notes[i]))
			fail_msg("there is no %s", notes[i]);
	unsigned effect_notes = 0;
	for (uint32_t i = 0; i < s.note_count; i++)
		effect_notes += strstr(s.notes[i], "no effect on light") != NULL;
	assert_int_equal(effect_notes, 3);
	scene_fini(&s);
}

/* An element that is ignored as a whole may contain the maximum path depth, which is visible in the image. */
static void test_depth_in_ignored_elements_is_noted(void **state)
{
	(void)state;
	check_note("<dpt><string name='a' value='b'/><integer name='maxdepth' value='8'/></dpt>",
		   "s.xml:1: <dpt> is ignored with its contents, including `maxdepth`: --max-depth 8 limits paths");
	check_note("<mode><integer name='max_Depth' value='12'/></mode>",
		   "including `max_Depth`: --max-depth 12 limits");
	static const char *const others[] = {"<integer name='maxdepth' value='-1'/>",
					     "<integer name='maxdepth' value='8x'/>",
					     "<integer name='maxdepths' value='8'/>",
					     "<integer name='maxdept' value='8'/>",
					     "<integer name='maxdepth'/>",
					     ""};
	for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
		char text[256];
		snprintf(text, sizeof text, "<dpt>%s</dpt>", others[i]);
		check_note(text, "<dpt> is ignored with its contents");
		check_note(text, NULL);
	}
}

static void test_mistyped_integrator_parameters_are_noted(void **state)
{
	(void)state;
	check_note(
		"<integrator type='path'><integer name='maxdepth' value='8'/></integrator>",
		"s.xml:1: <integrator type=\"path\">: `maxdepth` is not known and is ignored; did you mean `max_depth`?");
	check_note("<integrator type='path'><boolean name='hide_emiters' value='true'/></integrator>",
		   "did you mean `hide_emitters`?");
	check_note("<sampler type='independent'><integer name='sample_cout' value='8'/></sampler>",
		   "did you mean `sample_count`?");
	check_note(
		"<integrator type='path'><integer name='max_depth' value='8'/><boolean name='use_path_guiding' value='true'/>"
		"</integrator>",
		NULL);
}

/* None of Mitsuba's integrators that render all light is unknown, nor are those of this renderer. */
static void test_only_unknown_integrators_are_noted(void **state)
{
	(void)state;
	static const char *const types[] = {"path",
					    "volpath",
					    "volpathmis",
					    "volpath_simple",
					    "prb",
					    "prbvolpath",
					    "ptracer",
					    "bdpt",
					    "mlt",
					    "pssmlt",
					    "erpt",
					    "adaptive",
					    "motion",
					    "hslt",
					    "direct",
					    "prb_basic",
					    "prb_projective",
					    "moment",
					    "depth",
					    "direct_projective",
					    "photonmapper",
					    "sppm"};
	for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
		char xml[128];
		snprintf(xml, sizeof xml, "<integrator type='%s'/>", types[i]);
		check_note(xml, NULL);
	}
	check_note(
		"<integrator type='my_direct'/>",
		"<integrator type=\"my_direct\">: is not known: the image shows all light, on surfaces and in media");
	check_note(
		"<integrator type='pathh'/>",
		"<integrator type=\"pathh\">: is not known: the image shows all light, on surfaces and in media; did you mean "
		"`path`?");
	check_note(
		"<integrator type='stokes'><integrator type='my_direct'/></integrator>",
		"<integrator type=\"stokes\">: the `my_direct` inside it is not known: the image shows all light, on "
		"surfaces and in media, without its polarization");
}

/* Filters over a pixel's footprint are read as the closest supported filter. */
static void test_footprint_filters_become_bilinear(void **state)
{
	(void)state;
#define MAP(filter)                                                                                               \
	"<texture type='bitmap'><string name='filename' value='e.png'/><string name='filter_type' value='" filter \
	"'/></texture>"
	check_note(MAP("bilinear") MAP("nearest") MAP("ewa"), NULL);
	check_note(MAP("trilinear"),
		   "s.xml:1: <texture type=\"bitmap\">: filter_type `trilinear` is read as `bilinear`");
	check_note(MAP("anisotropic"), "filter_type `anisotropic` is read as `bilinear`");
#undef MAP
}

/* A sampler that only asks for a number of independent samples has nothing that is ignored. */
static void test_plain_independent_samplers_have_no_note(void **state)
{
	(void)state;
	static const struct {
		const char *version, *sampler;
		bool has_note;
	} cases[] = {
		{"3.0.0", "<sampler type='independent'><integer name='sample_count' value='9'/></sampler>", false},
		{"0.6.0", "<sampler type='Independent'><integer name='sampleCount' value='9'/></sampler>", false},
		{"3.0.0", "<sampler type='independent'/>", false},
		{"3.0.0", "<sampler type='independent'><integer name='seed' value='9'/></sampler>", true},
		{"3.0.0", "<sampler type='stratified'><integer name='sample_count' value='9'/></sampler>", true},
		{"3.0.0", "<integrator type='independent'/>", true},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[256];
		struct scene s;
		struct error e;
		snprintf(xml, sizeof xml, "<scene version='%s'>%s</scene>", cases[i].version, cases[i].sampler);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
		struct asset_source assets = memory_assets(files);
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s: %s", xml, e.text);
		if (scene_has_note(&s, "is ignored except for") != cases[i].has_note)
			fail_msg("%s: %s", xml, cases[i].has_note ? "no note" : s.notes[0]);
		scene_fini(&s);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_unsupported_parameters_are_noted),
		cmocka_unit_test(test_ignored_parameters_share_a_note),
		cmocka_unit_test(test_depth_in_ignored_elements_is_noted),
		cmocka_unit_test(test_mistyped_integrator_parameters_are_noted),
		cmocka_unit_test(test_only_unknown_integrators_are_noted),
		cmocka_unit_test(test_footprint_filters_become_bilinear),
		cmocka_unit_test(test_plain_independent_samplers_have_no_note),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
