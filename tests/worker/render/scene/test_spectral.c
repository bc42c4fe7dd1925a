/* SPDX-License-Identifier: Apache-2.0 */
/* All notations of spectra, search paths, and booleans as Python writes them. */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_tables.h"
#include "worker/render/math/cie.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const char spectrum_file[] = "# measured\r\n400 0.5\r\n500\t0.25\n  600 1e-1 \n";
static struct scene scene;

/* Returns the value of `eta` in a scene with this content, with the parameters and files below. */
static const struct value *read_eta(const char *version, const char *content)
{
	static char xml[2048];
	struct error e;
	snprintf(xml, sizeof xml,
		 "<scene version='%s'><path value='lib/'/><path value='spectra'/>"
		 "<bsdf type='roughconductor'>%s</bsdf></scene>",
		 version, content);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)},
					    {"a.spd", spectrum_file, sizeof spectrum_file - 1},
					    {"spectra/b.spd", spectrum_file, sizeof spectrum_file - 1},
					    {0}};
	struct asset_source assets = memory_assets(files);
	if (scene_read(&scene, &assets, "s.xml", scene_tables(), NULL, 0, &e))
		fail_msg("%s", e.text);
	return &node_find_property(scene.objects[0], "eta")->value;
}

static double spectrum_value_at(const struct value *v, double nm)
{
	assert_int_equal(v->type, VALUE_SPECTRUM);
	for (uint32_t i = 0; i < v->as.spectrum.count; i++)
		if (v->as.spectrum.nm[i] == nm)
			return v->as.spectrum.value[i];
	fail_msg("there is no value at %g nm", nm);
	return NAN;
}

static void test_spectrum_files_are_read(void **state)
{
	(void)state;
	const struct value *v = read_eta("3.0.0", "<spectrum name='eta' filename='a.spd'/>");
	assert_int_equal(v->as.spectrum.count, 3);
	assert_true(spectrum_value_at(v, 400) == 0.5 && spectrum_value_at(v, 500) == 0.25 &&
		    spectrum_value_at(v, 600) == 0.1);
	assert_int_equal(scene.asset_count, 1);
	assert_string_equal(scene.assets[0], "a.spd");
	scene_fini(&scene);
	/* Parameters that name the same file share its values. */
	v = read_eta("3.0.0", "<spectrum name='eta' filename='a.spd'/><spectrum name='k' filename='a.spd'/>");
	assert_ptr_equal(v->as.spectrum.value, node_find_property(scene.objects[0], "k")->value.as.spectrum.value);
	scene_fini(&scene);
	/* The file is found in the second folder and keeps this canonical name. */
	v = read_eta("0.6.0", "<spectrum name='eta' filename='b.spd'/>");
	assert_true(spectrum_value_at(v, 500) == 0.25);
	assert_string_equal(scene.assets[0], "spectra/b.spd");
	scene_fini(&scene);
}

/* Mistakes in a file are told with its name, and its line if they have one. */
static void test_invalid_spectrum_files_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *content, *message;
	} cases[] = {
		{"400 0.5\n# b\n5oo 1\n", "<spectrum>: lib/c.spd:3: not a line `nm value`, of at most "},
		{"400 1\n500\n", "<spectrum>: lib/c.spd:2: not a line `nm value`"},
		{"# none\n", "<spectrum>: lib/c.spd: has no line `nm value`"},
		{"400 1\n", "<spectrum>: lib/c.spd: one pair nm:value is not a spectrum"},
		{"400 1\n300 1\n", "<spectrum>: lib/c.spd: wavelengths must be positive and ascend: 300 nm does not"},
	};
	static const char xml[] = "<scene version='3.0.0'><bsdf type='roughconductor'>"
				  "<spectrum name='eta' filename='lib/c.spd'/></bsdf></scene>";
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		const struct memory_file files[] = {
			{"s.xml", xml, sizeof xml - 1}, {"lib/c.spd", cases[i].content, strlen(cases[i].content)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct error e;
		assert_true(scene_read(&scene, &assets, "s.xml", scene_tables(), NULL, 0, &e) < 0);
		if (!strstr(e.text, cases[i].message))
			fail_msg("%s", e.text);
	}
}

static void test_three_numbers_are_rgb_values(void **state)
{
	(void)state;
	const struct value *v = read_eta("0.6.0", "<spectrum name='eta' value='0.1, 0.2 0.3'/>");
	assert_true(v->type == VALUE_RGB && v->as.rgb[0] == 0.1 && v->as.rgb[1] == 0.2 && v->as.rgb[2] == 0.3);
	scene_fini(&scene);
}

static void test_spectra_of_each_type_are_read(void **state)
{
	(void)state;
	const struct value *v =
		read_eta("3.0.0", "<spectrum name='eta' type='uniform'><float name='value' value='2.5'/></spectrum>");
	assert_true(v->as.spectrum.count == 1 && v->as.spectrum.value[0] == 2.5);
	scene_fini(&scene);
	v = read_eta("3.0.0",
		     "<spectrum name='eta' type='regular'><float name='wavelength_min' value='400'/>"
		     "<float name='wavelength_max' value='600'/><string name='values' value='1, 2, 4'/></spectrum>");
	assert_true(v->as.spectrum.count == 3 && spectrum_value_at(v, 400) == 1 && spectrum_value_at(v, 500) == 2 &&
		    spectrum_value_at(v, 600) == 4);
	scene_fini(&scene);
	v = read_eta("3.0.0", "<spectrum name='eta' type='irregular'><string name='wavelengths' value='400 450 600'/>"
			      "<string name='values' value='1 2 4'/></spectrum>");
	assert_true(v->as.spectrum.count == 3 && spectrum_value_at(v, 450) == 2);
	scene_fini(&scene);
	v = read_eta("3.0.0", "<spectrum name='eta' type='srgb'><rgb name='color' value='0.5 0.25 1'/></spectrum>");
	assert_true(v->type == VALUE_RGB && v->as.rgb[1] == 0.25);
	scene_fini(&scene);
	v = read_eta("3.0.0", "<spectrum name='eta' type='d65'><float name='scale' value='3'/></spectrum>");
	double y = 0, one = 0; /* luminance 3, as for an RGB colour of 3 */
	for (int i = 0; i < CIE_COUNT; i++) {
		y += spectrum_value_at(v, CIE_FIRST_NM + i) * cie_observer[i][1];
		one += cie_observer[i][1];
	}
	assert_true(fabs(y / one - 3) < 1e-12);
	scene_fini(&scene);
	v = read_eta("3.0.0", "<spectrum name='eta' type='d65'><rgb name='color' value='0.5 0.25 1'/>"
			      "<float name='scale' value='3'/></spectrum>");
	assert_true(v->type == VALUE_RGB && v->as.rgb[0] == 1.5 && v->as.rgb[1] == 0.75 && v->as.rgb[2] == 3);
	scene_fini(&scene);
}

/* In 3.x, a spectrum is a texture of one colour, and may be written as one. */
static void test_spectra_may_be_written_as_textures(void **state)
{
	(void)state;
	const struct value *v =
		read_eta("3.0.0", "<texture name='eta' type='uniform'><float name='value' value='2.5'/></texture>");
	assert_true(v->as.spectrum.count == 1 && v->as.spectrum.value[0] == 2.5);
	scene_fini(&scene);
	v = read_eta("3.0.0", "<texture name='eta' type='rawconstant'><float name='value' value='0.5'/></texture>");
	assert_true(v->as.spectrum.count == 1 && v->as.spectrum.value[0] == 0.5);
	scene_fini(&scene);
	v = read_eta("3.0.0",
		     "<texture name='eta' type='rawconstant'><vector name='value' value='0.5 0.25 1'/></texture>");
	assert_true(v->type == VALUE_RGB && v->as.rgb[0] == 0.5 && v->as.rgb[1] == 0.25 && v->as.rgb[2] == 1);
	scene_fini(&scene);
}

/* A spectrum with a type is an object to which others may refer, also by an alias. */
static void test_spectra_may_be_referenced(void **state)
{
	(void)state;
	const struct value *v = read_eta(
		"3.0.0",
		"<ref name='eta' id='other'/></bsdf><alias id='s' as='other'/>"
		"<spectrum type='uniform' id='s'><float name='value' value='2.5'/></spectrum>"
		"<bsdf type='roughconductor'><spectrum name='k' type='uniform' id='k'><float name='value' value='3'/>"
		"</spectrum><ref name='eta' id='k'/>");
	assert_true(v->as.spectrum.count == 1 && v->as.spectrum.value[0] == 2.5);
	assert_true(node_find_property(scene.objects[1], "eta")->value.as.spectrum.value[0] == 3);
	assert_int_equal(scene.object_count, 2);
	scene_fini(&scene);
}

/* Against CIE illuminant A, which is Planck's law at 2848 K with c2 = 1.435e-2 m K: at 2855.5 K with today's c2.
 * Relative to 560 nm its table says 14.708 at 400 nm and 198.261 at 700 nm. And against the Stefan-Boltzmann law in
 * order of magnitude: 5000 K emit 1.29e4 W / (m^2 sr nm) at 550 nm. The values at 456 and 700 nm are those of Mitsuba
 * 3's tests. */
static void test_blackbody_matches_illuminant_a(void **state)
{
	(void)state;
	const struct value *v = read_eta("0.6.0", "<blackbody name='eta' temperature='2855.5K'/>");
	assert_true(fabs(100 * spectrum_value_at(v, 400) / spectrum_value_at(v, 560) / 14.708 - 1) < 2e-4);
	assert_true(fabs(100 * spectrum_value_at(v, 700) / spectrum_value_at(v, 560) / 198.261 - 1) < 2e-4);
	scene_fini(&scene);
	v = read_eta("3.0.0",
		     "<spectrum name='eta' type='blackbody'><float name='temperature' value='5000'/></spectrum>");
	double full = spectrum_value_at(v, 550);
	assert_true(fabs(full / 1.2703e4 - 1) < 2e-2);
	assert_true(fabs((0.8 * spectrum_value_at(v, 455) + 0.2 * spectrum_value_at(v, 460)) / 10997.9 - 1) < 1e-4);
	assert_true(fabs(spectrum_value_at(v, 700) / 11812 - 1) < 1e-5);
	scene_fini(&scene);
	v = read_eta("0.6.0", "<blackbody name='eta' temperature='5000k' scale='0.5'/>");
	assert_true(fabs(spectrum_value_at(v, 550) / full - 0.5) < 1e-15);
	scene_fini(&scene);
}

static void test_booleans_are_read_in_all_notations(void **state)
{
	(void)state;
	static const struct {
		const char *notation;
		bool value;
	} cases[] = {{"true", true},   {"True", true}, {"false", false},
		     {"False", false}, {"TRUE", true}, {"fAlSe", false}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[256];
		struct error e;
		snprintf(
			xml, sizeof xml,
			"<scene version='3.0.0'><shape type='cube'><boolean name='flip_normals' value='%s'/></shape></scene>",
			cases[i].notation);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
		struct asset_source assets = memory_assets(files);
		if (scene_read(&scene, &assets, "s.xml", scene_tables(), NULL, 0, &e))
			fail_msg("%s", e.text);
		assert_true(node_bool(scene.objects[0], "flip_normals", !cases[i].value) == cases[i].value);
		scene_fini(&scene);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_spectrum_files_are_read),
		cmocka_unit_test(test_invalid_spectrum_files_are_refused),
		cmocka_unit_test(test_three_numbers_are_rgb_values),
		cmocka_unit_test(test_spectra_of_each_type_are_read),
		cmocka_unit_test(test_spectra_may_be_written_as_textures),
		cmocka_unit_test(test_spectra_may_be_referenced),
		cmocka_unit_test(test_blackbody_matches_illuminant_a),
		cmocka_unit_test(test_booleans_are_read_in_all_notations),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
