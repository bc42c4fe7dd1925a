/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Values that Mitsuba 0.6 accepts and 3 does not: accepted with a note in files of 0.6, refused in files of 3.x. And
 * the values that exporters write by default.
 */
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"
#include "worker/render/scene/scene.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static int read_scene(struct scene *s, const char *version, const char *content, struct error *e)
{
	char xml[1024];
	snprintf(xml, sizeof xml, "<scene version='%s'>%s</scene>", version, content);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	struct asset_source assets = memory_assets(files);
	return scene_read(s, &assets, "s.xml", render_plugins(), NULL, 0, e);
}

/* note: part of the only note; NULL: there must be none. */
static struct scene read_with_note(const char *content, const char *note)
{
	struct scene s;
	struct error e;
	if (read_scene(&s, "0.6.0", content, &e))
		fail_msg("%s: %s", content, e.text);
	if (s.note_count != (note != NULL) || (note && !strstr(s.notes[0], note)))
		fail_msg("%s: %u notes, the first: %s", content, s.note_count, s.note_count ? s.notes[0] : "");
	return s;
}

static void expect_refused(const char *version, const char *content, const char *text)
{
	struct scene s;
	struct error e;
	if (read_scene(&s, version, content, &e) == 0 || !strstr(e.text, text))
		fail_msg("%s: %s\n not: %s", content, e.text, text);
}

static bool is_near(double a, double b)
{
	return fabs(a - b) <= 1e-15;
}

static void test_reflectances_are_scaled(void **state)
{
	(void)state;
	struct scene s =
		read_with_note("<bsdf type='diffuse'><rgb name='reflectance' value='2 1 0.5'/></bsdf>",
			       "s.xml:1: <bsdf type=\"diffuse\">: reflectance=2 is above 1: scaled by 0.495, as in "
			       "Mitsuba");
	const struct value *v = &node_find_property(s.objects[0], "reflectance")->value;
	assert_true(is_near(v->as.rgb[0], 0.99) && is_near(v->as.rgb[1], 0.495) && is_near(v->as.rgb[2], 0.2475));
	scene_fini(&s);

	s = read_with_note(
		"<bsdf type='phong'><spectrum name='specularReflectance' value='400:0.5, 500:4, 700:1'/></bsdf>",
		"specularReflectance=4 is above 1: scaled by 0.2475");
	v = &node_find_property(s.objects[0], "specular_reflectance")->value;
	assert_int_equal(v->as.spectrum.count, 3);
	assert_true(is_near(v->as.spectrum.value[0], 0.12375) && is_near(v->as.spectrum.value[1], 0.99) &&
		    is_near(v->as.spectrum.value[2], 0.2475) && v->as.spectrum.nm[1] == 500);
	scene_fini(&s);

	s = read_with_note("<bsdf type='difftrans'><spectrum name='transmittance' value='3'/></bsdf>",
			   "scaled by 0.33");
	scene_fini(&s);
	s = read_with_note("<bsdf type='diffuse'><rgb name='reflectance' value='1 1 1'/></bsdf>", NULL);
	assert_true(node_find_property(s.objects[0], "reflectance")->value.as.rgb[0] == 1);
	scene_fini(&s);

	expect_refused("3.0.0", "<bsdf type='diffuse'><rgb name='reflectance' value='2 1 0.5'/></bsdf>",
		       "outside [0, 1]");
	expect_refused("0.6.0", "<bsdf type='diffuse'><rgb name='reflectance' value='-1 2 0.5'/></bsdf>",
		       "outside [0, 1]");
	s = read_with_note("<bsdf type='mask'><rgb name='opacity' value='2 1 0.5'/><bsdf type='diffuse'/></bsdf>",
			   "opacity=2 is above 1: scaled by 0.495");
	v = &node_find_property(s.objects[0], "opacity")->value;
	assert_true(is_near(v->as.rgb[0], 0.99) && is_near(v->as.rgb[1], 0.495) && is_near(v->as.rgb[2], 0.2475));
	scene_fini(&s);
	expect_refused("0.6.0",
		       "<bsdf type='phong'><rgb name='specularReflectance' value='2 2 2'/>"
		       "<boolean name='ensureEnergyConservation' value='false'/></bsdf>",
		       "outside [0, 1]");
}

/* Values that Mitsuba clips when it uses them; in 0.6 only weights. */
static void test_weights_are_clipped(void **state)
{
	(void)state;
#define MIX(weight) "<bsdf type='blendbsdf'>" weight "<bsdf type='diffuse'/><bsdf type='diffuse'/></bsdf>"
#define MASK(opacity) "<bsdf type='mask'>" opacity "<bsdf type='diffuse'/></bsdf>"
	static const struct {
		const char *version, *bsdf, *note;
		double expected;
	} cases[] = {
		{"0.6.0", MIX("<float name='weight' value='1.5'/>"), "weight=1.5 is outside [0, 1] and counts as 1", 1},
		{"3.0.0", MIX("<float name='weight' value='-2'/>"), "weight=-2 is outside [0, 1] and counts as 0", 0},
		{"3.0.0", MIX("<integer name='weight' value='3'/>"), "weight=3 is outside [0, 1] and counts as 1", 1},
		{"3.0.0", MIX("<float name='weight' value='0.75'/>"), NULL, 0.75},
		{"3.0.0", MASK("<float name='opacity' value='1.0001'/>"), "opacity=1.0001 is outside", 1},
		{"3.0.0", MASK("<rgb name='opacity' value='1 2 1'/>"), "opacity=2 is outside", 1},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct scene s;
		struct error e;
		if (read_scene(&s, cases[i].version, cases[i].bsdf, &e))
			fail_msg("%s: %s", cases[i].bsdf, e.text);
		assert_int_equal(s.note_count, cases[i].note != NULL);
		assert_true(!cases[i].note || strstr(s.notes[0], cases[i].note));
		const struct property *p = node_find_property(s.objects[0], "weight");
		const struct value *v = &(p ? p : node_find_property(s.objects[0], "opacity"))->value;
		double got = v->type == VALUE_RGB ? v->as.rgb[1] : v->as.number;
		assert_true(got == cases[i].expected);
		scene_fini(&s);
	}
	expect_refused("3.0.0", MIX("<spectrum name='weight' value='400:0.5, 500:1.5'/>"),
		       "weight=1.5 is outside [0, 1]");
}

/* Parameters that plug-ins have in 3.x and not in 0.6. */
static void test_parameters_newer_than_0_6_are_ignored(void **state)
{
	(void)state;
#define BENT(type, scale)                                                                            \
	"<bsdf type='" type                                                                          \
	"'><texture name='normalmap' type='checkerboard'/><bsdf type='diffuse'/><float name='" scale \
	"' value='2'/></bsdf>"
#define GRID(value) "<volume type='gridvolume'><string name='filename' value='g'/>" value "</volume>"
#define FILTER(type, name) "<rfilter type='" type "'><float name='" name "' value='2'/></rfilter>"
	static const struct {
		const char *content, *name, *written_name;
		bool is_kept; /* the parameter exists in 0.6 as well */
	} cases[] = {
		{BENT("bumpmap", "scale"), "scale", "scale", false},
		{BENT("normalmap", "scale"), "scale", "scale", false},
		{GRID("<string name='filter_type' value='nearest'/>"), "filter_type", "filter_type", false},
		{GRID("<string name='wrap_mode' value='repeat'/>"), "wrap_mode", "wrap_mode", false},
		{GRID("<boolean name='use_grid_bbox' value='true'/>"), "use_grid_bbox", "use_grid_bbox", false},
		{FILTER("tent", "radius"), "radius", "radius", false},
		{FILTER("gaussian", "radius"), "radius", "radius", false},
		{FILTER("gaussian", "stddev"), "stddev", "stddev", true},
		{FILTER("box", "radius"), "radius", "radius", true},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char note[128];
		snprintf(note, sizeof note, "`%s` is not a parameter of Mitsuba 0.6 and is ignored, as there",
			 cases[i].written_name);
		struct scene s = read_with_note(cases[i].content, cases[i].is_kept ? NULL : note);
		assert_true((node_find_property(s.objects[0], cases[i].name) != NULL) == cases[i].is_kept);
		scene_fini(&s);
		struct error e;
		if (read_scene(&s, "3.0.0", cases[i].content, &e))
			fail_msg("%s: %s", cases[i].content, e.text);
		assert_true(s.note_count == 0 && node_find_property(s.objects[0], cases[i].name));
		scene_fini(&s);
	}
#undef BENT
#undef GRID
#undef FILTER
}

static void test_capitals_are_ignored_in_0_6(void **state)
{
	(void)state;
#define IMAGE(name, value)                                                                                          \
	"<texture type='bitmap'><string name='filename' value='A.png'/><string name='" name "' value='" value "'/>" \
	"</texture>"
	struct scene s = read_with_note(IMAGE("filterType", "EWA"), NULL);
	assert_string_equal(node_string(s.objects[0], "filter_type", ""), "ewa");
	assert_string_equal(node_string(s.objects[0], "filename", ""), "A.png");
	scene_fini(&s);
	s = read_with_note(IMAGE("channel", "R"), NULL);
	assert_string_equal(node_string(s.objects[0], "channel", ""), "r");
	scene_fini(&s);
	s = read_with_note("<bsdf type='roughconductor'><string name='distribution' value='GGX'/></bsdf>", NULL);
	assert_string_equal(node_string(s.objects[0], "distribution", ""), "ggx");
	scene_fini(&s);
	expect_refused("3.0.0", IMAGE("filter_type", "Nearest"), "did you mean `nearest`?");
	expect_refused("0.6.0", IMAGE("filterType", "Nearer"), "is not supported");
#undef IMAGE
}

static void test_other_distributions_become_beckmann(void **state)
{
	(void)state;
#define ROUGH(x) "<bsdf type='roughconductor'><string name='distribution' value='" x "'/></bsdf>"
	static const char *const old[] = {"phong", "as"};
	for (size_t i = 0; i < sizeof old / sizeof *old; i++) {
		char note[128];
		snprintf(note, sizeof note, "the distribution `%s` becomes `beckmann`, which falls off faster", old[i]);
		struct scene s = read_with_note(i ? ROUGH("as") : ROUGH("phong"), note);
		assert_string_equal(node_string(s.objects[0], "distribution", ""), "beckmann");
		scene_fini(&s);
	}
	expect_refused("3.0.0", ROUGH("phong"), "is not supported (supported: beckmann, ggx)");
	expect_refused("0.6.0", ROUGH("ggy"), "did you mean `ggx`?");
}

static void test_negative_metal_indices_become_positive(void **state)
{
	(void)state;
	struct scene s =
		read_with_note("<bsdf type='roughconductor'><rgb name='eta' value='-0.0485226, 4.14275, 4.66977'/>"
			       "</bsdf>",
			       "eta=-0.0485226 is below 0: its sign is ignored, as in Mitsuba");
	const double *eta = node_find_property(s.objects[0], "eta")->value.as.rgb;
	assert_true(eta[0] == 0.0485226 && eta[1] == 4.14275 && eta[2] == 4.66977);
	scene_fini(&s);
	s = read_with_note("<bsdf type='conductor'><float name='k' value='-3'/></bsdf>", "k=-3 is below 0");
	assert_true(node_find_property(s.objects[0], "k")->value.as.number == 3);
	scene_fini(&s);
	s = read_with_note("<bsdf type='conductor'><rgb name='k' value='3 2 0'/></bsdf>", NULL);
	scene_fini(&s);
	expect_refused("3.0.0", "<bsdf type='conductor'><rgb name='k' value='3 -2 1'/></bsdf>", "k=-2 is outside");
}

static void test_unknown_parameters_are_ignored_in_0_6(void **state)
{
	(void)state;
	struct scene s = read_with_note("<bsdf type='diffuse'><string name='guidingFile' value='x'/></bsdf>",
					"s.xml:1: <bsdf type=\"diffuse\">: `guidingFile` is not known and is ignored");
	scene_fini(&s);
	s = read_with_note("<integer name='maxDepth' value='10'/>", "<integer>: `maxDepth` is ignored");
	scene_fini(&s);
	expect_refused("0.6.0", "<bsdf type='diffuse'><rgb name='reflectence' value='1'/></bsdf>",
		       "did you mean `reflectance`?");
	/* In 3.x only, a parameter of another plug-in is a mistake. */
	s = read_with_note("<bsdf type='diffuse'><float name='exponent' value='9'/></bsdf>",
			   "`exponent` is not known and is ignored");
	scene_fini(&s);
	expect_refused("3.0.0", "<bsdf type='diffuse'><float name='exponent' value='9'/></bsdf>", "has no `exponent`");
	s = read_with_note("<emitter type='constant'><float name='scale' value='2'/></emitter>",
			   "`scale` is not known and is ignored");
	scene_fini(&s);
	expect_refused("3.0.0", "<emitter type='constant'><float name='scale' value='2'/></emitter>", "has no `scale`");
	/* A name that resembles a parameter without effect is harmless. */
	s = read_with_note("<emitter type='constant'><float name='samplingWeights' value='2'/></emitter>",
			   "`samplingWeights` is not known and is ignored");
	scene_fini(&s);
	expect_refused("0.6.0", "<emitter type='sky'><float name='turbidit' value='3'/></emitter>",
		       "did you mean `turbidity`?");
	expect_refused("3.0.0", "<integer name='max_depth' value='10'/>", "has no place in <scene>");
	expect_refused("0.6.0", "<bsdf type='diffuse'><spectrum name='reflectance' type='bitmap'/></bsdf>",
		       "there is no spectrum of this type");
}

/* Mitsuba 0.6 warns of parameters that no plug-in reads, in objects of every class. */
static void test_unknown_parameters_are_noted_in_every_class(void **state)
{
	(void)state;
#define INSIDE(x) "<medium type='homogeneous'>" x "</medium>"
#define SENSOR(x) "<emitter type='constant'/><sensor type='perspective'>" x "</sensor>"
	static const char *const kept[] = {
		INSIDE("<string name='guidingFile' value='x'/>"),
		INSIDE("<phase type='hg'><string name='guidingFile' value='x'/></phase>"),
		"<volume type='constvolume'><float name='value' value='1'/><string name='guidingFile' value='x'/></volume>",
		SENSOR("<film type='hdrfilm'><rfilter type='box'><string name='guidingFile' value='x'/></rfilter></film>"),
		SENSOR("<film type='hdrfilm'><string name='guidingFile' value='x'/></film>"),
		SENSOR("<string name='guidingFile' value='x'/>"),
	};
	for (size_t i = 0; i < sizeof kept / sizeof *kept; i++) {
		struct scene s = read_with_note(kept[i], "is not known and is ignored");
		scene_fini(&s);
	}
	/* Samplers and integrators get only the note that says which of their parameters count. */
	struct scene s = read_with_note("<integrator type='path'><string name='guidingFile' value='x'/></integrator>",
					"is ignored except for");
	scene_fini(&s);
	expect_refused("0.6.0", INSIDE("<float name='sigmaT1' value='x'/>"),
		       "has no `sigmaT1`; did you mean `sigma_t`?");
#undef INSIDE
#undef SENSOR
}

/* The default parameters that the Blender exporter of 0.5 writes for images. */
static void test_undefined_parameters_of_the_blender_exporter_are_kept(void **state)
{
	(void)state;
	struct scene s = read_with_note("<default name='a' value='7'/><bsdf type='diffuse'>"
					"<string name='label[10,10]' value=\"Time: $scene['renderTime'], $a\"/></bsdf>",
					"`label[10,10]` is not known and is ignored");
	scene_fini(&s);
	s = read_with_note("<default name='ab' value='7'/><bsdf type='diffuse' id='$x[$ab]$'/>", NULL);
	assert_string_equal(s.objects[0]->id, "$x[7]$");
	scene_fini(&s);
	expect_refused("0.6.0", "<bsdf type='diffuse' id='$x'/>", "$x is not defined");
	expect_refused("3.0.0", "<bsdf type='diffuse' id='$x[0]'/>", "$x is not defined");
}

/* The Blender exporter for 3.x writes values slightly above 1. */
static void test_specular_may_exceed_one(void **state)
{
	(void)state;
	struct scene s;
	struct error e;
	assert_int_equal(
		read_scene(&s, "3.0.0", "<bsdf type='principled'><float name='specular' value='1.001'/></bsdf>", &e),
		0);
	scene_fini(&s);
	expect_refused("3.0.0", "<bsdf type='principled'><float name='specular' value='9'/></bsdf>", "outside [0, 8]");
}

/* Parameters given twice: the last one with the same name counts, and the name that belongs to 0.6. */
static void test_last_of_repeated_parameters_counts(void **state)
{
	(void)state;
	static const struct {
		const char *first, *second, *note, *axis;
	} cases[] = {
		{"fovAxis' value='y", "fovAxis' value='x",
		 "s.xml:1: <string>: `fovAxis` is given twice (first in line 1); the last counts, as in Mitsuba 0.6",
		 "x"},
		{"fovAxis' value='y", "fov_axis' value='x",
		 "`fov_axis` is given twice (first in line 1); the first counts", "y"},
		{"fov_axis' value='y", "fovAxis' value='x",
		 "`fovAxis` is given twice (first in line 1); the last counts", "x"},
		{"fov_axis' value='y", "fov_axis' value='x", "the last counts", "x"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[512];
		/* clang-format off */
		snprintf(xml, sizeof xml,
			"<sensor type='perspective'>"
				"<float name='fov' value='45'/>"
				"<string name='%s'/>"
				"<string name='%s'/>"
			"</sensor>"
			"<emitter type='constant'/>",
			cases[i].first, cases[i].second);
		/* clang-format on */
		struct scene s = read_with_note(xml, cases[i].note);
		assert_int_equal(s.objects[0]->property_count, 2);
		assert_string_equal(node_string(s.objects[0], "fov_axis", ""), cases[i].axis);
		scene_fini(&s);
		expect_refused("3.0.0",
			       "<sensor type='perspective'><string name='fov_axis' value='x'/>"
			       "<string name='fov_axis' value='x'/></sensor>",
			       "`fov_axis` is given twice (first in line 1)");
	}
	/* Two names of 0.6 for the same parameter. */
	expect_refused(
		"0.6.0",
		"<bsdf type='diffuse'><rgb name='reflectance' value='1'/><rgb name='diffuseReflectance' value='1'/></bsdf>",
		"`reflectance` is given twice");
}

/* Files of 0.5 and 0.6 without an emitter get the sun and sky that Mitsuba adds; those of 3.x do not. */
static void test_sun_and_sky_are_added_to_dark_old_scenes(void **state)
{
	(void)state;
	struct scene s = read_with_note("<shape type='sphere'/>",
					"s.xml: has no emitter: sun and sky are added, as by Mitsuba 0.6");
	assert_int_equal(s.object_count, 2);
	const struct scene_node *n = s.objects[1];
	assert_string_equal(n->type, "sunsky");
	assert_true(node_float(n, "scale", 0) == 2 && node_float(n, "sun_radius_scale", 0) == 15 &&
		    node_bool(n, "extend", false));
	mat4 place = node_transform(n, "to_world");
	double angle = -120 * 3.14159265358979323846 / 180;
	assert_true(fabs(place.m[0][0] - cos(angle)) < 1e-12 && fabs(place.m[0][2] - sin(angle)) < 1e-12 &&
		    place.m[1][1] == 1);
	scene_fini(&s);

	static const char *const lit[] = {
		"<shape type='sphere'><emitter type='area'/></shape>",
		"<emitter type='constant'/><shape type='sphere'/>",
		"<shape type='shapegroup' id='g'><shape type='sphere'><emitter type='area'/></shape></shape>",
	};
	for (size_t i = 0; i < sizeof lit / sizeof *lit; i++) {
		s = read_with_note(lit[i], NULL);
		for (uint32_t k = 0; k < s.object_count; k++)
			assert_true(strcmp(s.objects[k]->type, "sunsky") != 0);
		scene_fini(&s);
	}
	s = read_with_note("<bsdf type='diffuse'/>", NULL); /* a file meant to be included */
	assert_int_equal(s.object_count, 1);
	scene_fini(&s);
	struct error e;
	assert_int_equal(read_scene(&s, "3.0.0", "<shape type='sphere'/>", &e), 0);
	assert_int_equal(s.object_count, 1);
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_reflectances_are_scaled),
		cmocka_unit_test(test_weights_are_clipped),
		cmocka_unit_test(test_parameters_newer_than_0_6_are_ignored),
		cmocka_unit_test(test_capitals_are_ignored_in_0_6),
		cmocka_unit_test(test_other_distributions_become_beckmann),
		cmocka_unit_test(test_negative_metal_indices_become_positive),
		cmocka_unit_test(test_unknown_parameters_are_ignored_in_0_6),
		cmocka_unit_test(test_unknown_parameters_are_noted_in_every_class),
		cmocka_unit_test(test_undefined_parameters_of_the_blender_exporter_are_kept),
		cmocka_unit_test(test_specular_may_exceed_one),
		cmocka_unit_test(test_last_of_repeated_parameters_counts),
		cmocka_unit_test(test_sun_and_sky_are_added_to_dark_old_scenes),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
