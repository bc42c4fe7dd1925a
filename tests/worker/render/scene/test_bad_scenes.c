/* SPDX-License-Identifier: Apache-2.0 */
/* Every bad input gives an error that names the place and, where it is known, the correct input. */
#include "common/base/mem.h"
#include "tests/support/failing_memory.h"
#include "tests/support/memory_assets.h"
#include "tests/support/scene_tables.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static int read_files(const struct memory_file *files, struct error *e)
{
	struct asset_source assets = memory_assets(files);
	struct scene s;
	int r = scene_read(&s, &assets, files[0].name, scene_tables(), NULL, 0, e);
	if (!r)
		scene_fini(&s);
	else if (s.arena.blocks || s.objects)
		fail_msg("the scene is not empty after: %s", e ? e->text : "");
	return r;
}

static int read_text(const char *xml, struct error *e)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	return read_files(files, e);
}

static void expect_refused(const char *xml, const char *text)
{
	struct error e = {"no error at all"};
	int r = read_text(xml, &e);
	if (r >= 0 || !strstr(e.text, text))
		fail_msg("%.200s\n  gave %d: %s\n  not: %s", xml, r, e.text, text);
}

#define SIXTY_LETTERS "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
#define S "<scene version='3.0.0'>"
#define END "</scene>"
#define BSDF(x) S "<bsdf type='roughconductor'>" x "</bsdf>" END
#define SHAPE(x) S "<shape type='cube'><transform name='to_world'>" x "</transform></shape>" END

static void test_malformed_files_are_refused(void **state)
{
	(void)state;
	expect_refused("", "s.xml: the file is empty");
	expect_refused("hello", "s.xml: this is neither Mitsuba's XML nor a glTF file");
	expect_refused(" ply\nformat ascii 1.0\n", "s.xml: this is neither Mitsuba's XML nor a glTF file");
	expect_refused("\x89PNG\r\n", "s.xml: this is neither Mitsuba's XML nor a glTF file");
	expect_refused("\n <>", "s.xml:2: not well-formed");
	expect_refused("\xef\xbb\xbf<>", "s.xml:1: not well-formed");
	expect_refused("hello " S, "s.xml: this is neither");
	expect_refused(" " S "\n</shape>\nhello<", "s.xml:2: mismatched tag");
	expect_refused(S "\n<shape type='cube'>\n", "s.xml:3: the file ends before </shape>");
	expect_refused(S "\n<shape type='cube'></bsdf>" END, "s.xml:2: mismatched tag in <shape>");
	expect_refused(S "<shape type='cube' type='obj'/>" END, "duplicate attribute");
	expect_refused("<scene version='0.6.0'/><x/>", "junk after document element");
	expect_refused(S "\xff\xfe" END, "not well-formed");
	expect_refused(S "&unknown;" END, "text is not allowed here");
	expect_refused(S "<shape type='sphere'><float name='radius'>2</float></shape>" END,
		       "values are given by attributes");
	expect_refused(S "words" END, "text is not allowed here");
	expect_refused("<scenes version='3.0.0'/>", "a scene file must begin with <scene");
	expect_refused("<scene/>", "needs a version, such as version=");
	expect_refused("<scene version='three'/>", "needs a version, such as version=");
	expect_refused("<scene version='3.0.0' verzion='1'/>", "has no attribute `verzion`; did you mean `version`?");
}

static void test_document_types_are_refused(void **state)
{
	(void)state;
	expect_refused(
		"<?xml version='1.0'?>\n<!DOCTYPE scene [<!ENTITY a 'aaaaaaaaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;&a;&a;'>"
		"<!ENTITY c '&b;&b;&b;&b;&b;&b;&b;&b;'>]><scene version='3.0.0'>&c;</scene>",
		"s.xml:2: <!DOCTYPE>");
	expect_refused("<!DOCTYPE scene SYSTEM 'file:///etc/passwd' []><scene version='3.0.0'/>", "<!DOCTYPE>");
}

/* Like the entity bomb, but with parameters: each value contains the one before it twice. */
static void test_growing_parameter_values_are_refused(void **state)
{
	(void)state;
	static char xml[1 << 16];
	size_t n = (size_t)snprintf(xml, sizeof xml, S "<default name='a0' value='0123456789012345'/>");
	for (int i = 1; i < 40; i++)
		n += (size_t)snprintf(xml + n, sizeof xml - n, "<default name='a%d' value='$a%d$a%d'/>", i, i - 1,
				      i - 1);
	snprintf(xml + n, sizeof xml - n, END);
	expect_refused(xml, "a value of more than");
}

static void test_nesting_depth_is_limited(void **state)
{
	(void)state;
	static char xml[8 << 20];
	char *p = xml;
	p += sprintf(p, S "\n");
	for (int i = 0; i < 100000; i++)
		p += sprintf(p, "<bsdf type='twosided'>");
	expect_refused(xml, "s.xml:2: <bsdf>: elements are nested more than 64 deep");
	p = xml;
	p += sprintf(p, S "<bsdf type='diffuse' id='m5000'/>");
	for (int i = 4999; i >= 0; i--)
		p += sprintf(p, "<bsdf type='twosided' id='m%d'><ref id='m%d'/></bsdf>", i, i + 1);
	sprintf(p, END);
	assert_int_equal(read_text(xml, NULL), 0); /* each object is built after the one that it refers to */
	p = xml;
	p += sprintf(p, S);
	for (int i = 0; i < 100000; i++)
		p += sprintf(p, "<bsdf type='twosided' id='m%d'><ref id='m%d'/></bsdf>", i, i + 1);
	sprintf(p, "<bsdf type='diffuse' id='m100000'/>" END);
	expect_refused(xml, "objects refer to each other more than 64 deep");
}

/* The limit on nesting counts across included files, from the object that includes them. */
static void test_nesting_depth_counts_across_included_files(void **state)
{
	(void)state;
	enum { DEPTH_PER_FILE = 40 };
	static char outer[4096], inner[4096];
	const char *name[] = {"i.xml", "n.xml"};
	char *text[] = {outer, inner};
	for (int k = 0; k < 2; k++) {
		char *p = text[k];
		for (int i = 0; i < DEPTH_PER_FILE; i++)
			p += sprintf(p, "<bsdf type='twosided'%s>", i ? "" : " version='3.0.0'");
		p += k ? 0 : sprintf(p, "<include filename='n.xml'/>");
		for (int i = 0; i < DEPTH_PER_FILE; i++)
			p += sprintf(p, "</bsdf>");
	}
	static const char main_file[] = S "<include filename='i.xml'/>" END;
	const struct memory_file files[] = {{"s.xml", main_file, sizeof main_file - 1},
					    {name[0], outer, strlen(outer)},
					    {name[1], inner, strlen(inner)},
					    {0}};
	struct error e = {""};
	assert_true(read_files(files, &e) < 0);
	if (!strstr(e.text, "n.xml:1: <bsdf>: elements are nested more than 64 deep"))
		fail_msg("%s", e.text);
}

static void test_number_of_elements_is_limited(void **state)
{
	(void)state;
	size_t n = (1 << 20) + 16, size = n * 4 + 128;
	char *xml = mem_alloc(size, 1), *p = xml;
	p += sprintf(p, S "<mode>");
	for (size_t i = 0; i < n; i++, p += 4)
		memcpy(p, "<m/>", 4);
	sprintf(p, "</mode>" END);
	expect_refused(xml, "more than 1048576 elements");
	mem_free(xml);
}

static void test_unknown_names_get_suggestions(void **state)
{
	(void)state;
	expect_refused(S "\n<bsdf type='difuse'/>" END,
		       "s.xml:2: <bsdf type=\"difuse\">: there is no bsdf of this type; did you mean "
		       "`diffuse`? --lenient uses the bsdf inside it, or `diffuse`, instead (supported: diffuse, ");
	expect_refused(S "<sensor type='perspectiv'/>" END, "did you mean `perspective`? (supported: perspective");
	expect_refused(S "<probe type='x'/>" END,
		       "<probe type=\"x\">: there is no element of this name; --lenient leaves it out");
	expect_refused(
		S "<bsdf type='irawan'/>" END,
		"this bsdf of Mitsuba's is not supported; --lenient uses the bsdf inside it, or `diffuse`, instead "
		"(supported: diffuse, roughconductor");
	expect_refused(S "<bsdf type='roughgrating'/>" END,
		       "there is no bsdf of this type; --lenient uses the bsdf inside");
	expect_refused(S "<rfilter type='blackman'/>" END, "; --lenient uses `gaussian` instead");
	expect_refused(
		S "<shape type='ellipsoids'/>" END,
		"<shape type=\"ellipsoids\">: this shape of Mitsuba's is not supported; --lenient leaves it out (supp");
	expect_refused(
		S "<medium type='smoke'/>" END,
		"s.xml:1: <medium type=\"smoke\">: there is no medium of this type; --lenient leaves it out (supported: "
		"homogeneous, heterogeneous)");
	expect_refused(
		S "<medium type='homogeneous'>\n<phase type='kkay'/></medium>" END,
		"s.xml:2: <phase type=\"kkay\">: this phase of Mitsuba's is not supported; --lenient uses `isotropic` "
		"instead (supported: isotropic, hg, rayleigh, blendphase, mixturephase, tabphase, sggx)");
	expect_refused(
		S "<medium type='homogeneous'>\n<volume type='volcache' name='albedo'/></medium>" END,
		"s.xml:2: <volume type=\"volcache\">: this volume of Mitsuba's is not supported; --lenient leaves it out "
		"(supported: constvolume, gridvolume)");
	expect_refused(S "<shape type='cube'><volume type='constvolume'/></shape>" END,
		       "a volume without a name has no place in <shape");
	expect_refused(S "<phase type='isotropic'><float name='g' value='0.5'/></phase>" END,
		       "<phase type=\"isotropic\"> has no `g`");
	expect_refused(S "<shape type='cube'><phase type='hg'/></shape>" END,
		       "a phase without a name has no place in <shape");
	expect_refused(S "<shape type='cube'>\n<subsurface type='dipole'/></shape>" END,
		       "subsurface scattering is not");
	expect_refused(S "<bdsf type='diffuse'/>" END, "did you mean `bsdf`?");
	expect_refused(S "<luminaire type='area'/>" END, "<luminaire");
	expect_refused(S "<float name='radius' value='1'/>" END, "<float>: has no place in <scene>");
	expect_refused(S "<float value='1'/>" END, "<float>: has no place in <scene>");
	expect_refused(S "<light type='point'/>" END, "there is no element of this name; did you mean `emitter`?");
	expect_refused(BSDF("<int name='a' value='1'/>"), "there is no element of this name; did you mean `integer`?");
	expect_refused(S "<bsdf/>" END, "needs an attribute `type`");
	expect_refused(S "<sensor type='fluxmeter'/>" END, "supported: perspective, thinlens, orthographic");
	expect_refused(S "<sensor type='perspective'><film type='hdrfilm'><rfilter type='wiener'/></film></sensor>" END,
		       "supported: box, tent, gaussian, mitchell, catmullrom, lanczos");
	expect_refused(BSDF("\n<float name='alhpa' value='1'/>"),
		       "s.xml:2: <float>: <bsdf type=\"roughconductor\"> has no `alhpa`; "
		       "did you mean `alpha`? (supported: alpha, ");
	expect_refused(BSDF("<boolean name='nonlinear' value='true'/>"),
		       "would change the image and is not supported; supported: alpha");
	expect_refused(BSDF("<string name='distribution' value='beckman'/>"),
		       "did you mean `beckmann`? (supported: beckmann, ggx)");
	expect_refused(BSDF("<flaot name='alpha' value='1'/>"), "did you mean `float`?");
	/* text that is quoted and truncated stays UTF-8: 63 letters and half of one */
	expect_refused(S "<bsdf type='" SIXTY_LETTERS "xxx\xc3\xa4'/>" END,
		       "<bsdf type=\"" SIXTY_LETTERS "xxx?\">: there is no bsdf");
}

/* A file outside the scene's folder is named as the scene's author wrote it. */
static void test_errors_name_outside_files_as_written(void **state)
{
	(void)state;
	static const char outer[] = S "<include filename='a/../../i.xml'/>" END,
			  inner[] = S "\n<shape type='cub'/>" END;
	const struct memory_file files[] = {
		{"s.xml", outer, sizeof outer - 1}, {"%2e%2e/i.xml", inner, sizeof inner - 1}, {0}};
	struct error e;
	assert_int_equal(read_files(files, &e), -EINVAL);
	assert_memory_equal(e.text, "../i.xml:2: <shape", 18);
}

static void test_invalid_values_are_refused(void **state)
{
	(void)state;
	expect_refused(BSDF("<float name='alpha' value='nan'/>"), "`nan` is not a (finite) number");
	expect_refused(BSDF("<float name='alpha' value='1e999'/>"), "is not a (finite) number");
	expect_refused(BSDF("<float name='alpha' value='0,1'/>"), "is not a (finite) number");
	expect_refused(BSDF("<float name='alpha' value='1.5'/>"), "alpha=1.5 is outside [0.0001, 1]");
	expect_refused(BSDF("<float name='alpha'/>"), "needs an attribute `value`");
	expect_refused(BSDF("<float value='1'/>"), "needs an attribute `name`");
	expect_refused(BSDF("<float nme='alpha' value='1'/>"), "needs an attribute `name`, but has `nme`");
	expect_refused(BSDF("<float name='alpha' value='${1+2}'/>"),
		       "in `${1+2}` no name follows the $: write $name to insert a parameter, \\$ for the character");
	expect_refused(BSDF("<float name='alpha' valeu='1'/>"), "has no attribute `valeu`; did you mean `value`?");
	expect_refused(BSDF("<float name='alpha' value='$x'/>"), "$x is not defined");
	expect_refused(BSDF("<float name='alpha' value='0.1'/><float name='alpha' value='0.2'/>"), "given twice");
	expect_refused(BSDF("<string name='alpha' value='0.1'/>"), "`alpha` cannot have this type (supported: float)");
	expect_refused(BSDF("<float name='alpha' value='.1'><x/></float>"), "has no place in <float>");
	expect_refused(BSDF("<rgb name='eta' value='1, 2'/>"), "neither three numbers nor one");
	expect_refused(BSDF("<rgb name='eta' value='1, inf, 2'/>"), "neither three numbers nor one");
	expect_refused(BSDF("<rgb name='eta' value='#ff0000'/>"), "#rrggbb is for <srgb>");
	expect_refused(BSDF("<srgb name='eta' value='#ff00gg'/>"), "nor #rrggbb");
	expect_refused(BSDF("<spectrum name='eta' value='400:1'/>"), "one pair");
	expect_refused(BSDF("<spectrum name='eta' value='500:1, 400:1'/>"), "must be positive and ascend");
	expect_refused(BSDF("<spectrum name='eta' value='400:1, 500'/>"), "neither a number nor a list");
	expect_refused(BSDF("<spectrum name='eta' value='1, 2, 3'/>"), "three numbers are for <rgb>");
	expect_refused(BSDF("<spectrum name='eta' filename='x.spd'/>"), "s.xml:1: <spectrum>: x.spd: no such file");
	expect_refused(BSDF("<spectrum name='eta'/>"), "needs either value or filename or type");
	expect_refused(BSDF("<spectrum name='eta' value='1' type='d65'/>"), "needs either value or filename or type");
	expect_refused(BSDF("<spectrum name='eta' type='d56'/>"),
		       "there is no spectrum of this type; did you mean `d65`?");
	expect_refused(BSDF("<spectrum name='eta' type='d65'><float name='gain' value='2'/></spectrum>"),
		       "has no place in a spectrum of type `d65`");
	expect_refused(BSDF("<spectrum name='eta' type='d65'><float name='scale' value='-1'/></spectrum>"),
		       "scale=\"-1\" is not a number from 0");
	expect_refused(BSDF("<spectrum name='eta' type='regular'><string name='values' value='1,2'/></spectrum>"),
		       "needs `wavelength_min`");
	expect_refused(BSDF("<spectrum name='eta' type='irregular'><string name='wavelengths' value='1,2'/>"
			    "<string name='values' value='1,2,3'/></spectrum>"),
		       "2 wavelengths, but 3 values");
	expect_refused(BSDF("<spectrum name='eta' type='irregular'><string name='wavelengths' value='2,1'/>"
			    "<string name='values' value='1,2'/></spectrum>"),
		       "wavelengths must be positive and ascend");
	expect_refused(BSDF("<spectrum name='eta' type='srgb'/>"), "needs `color`");
	expect_refused(BSDF("<blackbody name='eta'/>"), "needs a temperature");
	expect_refused(BSDF("<blackbody name='eta' temperature='hot'/>"), "temperature=\"hot\" is not a number");
	expect_refused(BSDF("<blackbody name='eta' temperature='1'/>"), "a temperature of 1 K is outside [100, 1e+06]");
	expect_refused(BSDF("<color name='eta'/>"), "is not supported; supported: boolean");
	expect_refused("<scene version='0.6.0'><path/></scene>",
		       "s.xml:1: <path>: needs a value: the name of a folder");
	expect_refused(S "<shape type='sphere'><boolean name='flip_normals' value='yes'/></shape>" END,
		       "neither true nor false");
	expect_refused(S "<shape type='sphere'><float name='radius' value='0'/></shape>" END, "must be positive");
	expect_refused(S "<shape type='sphere'><float name='radius' value='-1'/></shape>" END, "must be positive");
	expect_refused(S "<shape type='obj'><string name='filename' value=''/></shape>" END, "an empty file name");
}

static void test_invalid_transforms_are_refused(void **state)
{
	(void)state;
	expect_refused(SHAPE("<matrix value='1 2 3'/>"), "with 16 or 9 numbers");
	expect_refused(SHAPE("<matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2'/>"), "the last row must be 0 0 0 1");
	expect_refused(SHAPE("<matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0.0001 0 1'/>"), "the last row must be 0 0 0 1");
	expect_refused(SHAPE("<rotate angle='90' x='0'/>"), "has no axis");
	expect_refused(SHAPE("<rotate x='1'/>"), "needs an angle");
	expect_refused(SHAPE("<translate/>"), "needs either x, y, z or value");
	expect_refused(SHAPE("<translate x='1' value='1 2 3'/>"), "needs either x, y, z or value");
	expect_refused(SHAPE("<skale x='1'/>"), "did you mean `scale`?");
	expect_refused(SHAPE("<lookat origin='0 0 0' target='0 0 0' up='0 1 0'/>"), "origin and target are equal");
	expect_refused(SHAPE("<lookat origin='0 0 0' target='0 1 0' up='0 1 0'/>"), "up is parallel to the view");
	expect_refused(SHAPE("<lookat origin='0 0 0' up='0 1 0'/>"), "needs an attribute `target`");
	expect_refused(SHAPE("<lookat origin='0 1 0' target='0 1 0'/>"), "origin and target are equal");
	expect_refused(SHAPE("<scale value='1e50'/><scale value='1e50'/>"), "the transform is out of range");
	expect_refused(SHAPE("<scale value='1e61'/>"), "s.xml:1: <scale>: value=1e+61 is outside [-1e+60, 1e+60]");
	expect_refused(SHAPE("<lookat origin='1e154 0 0' target='0 0 0' up='0 1 0'/>"), "origin=1e+154 is outside");
}

/* The error names the shape that is flat: for an instance of a good shape, the instance. */
static void test_flattening_transforms_are_refused(void **state)
{
	(void)state;
	static const char *const flat[] = {"<scale y='0'/>", "<scale value='0'/>",
					   "<matrix value='1 0 0 0 1 0 1 1 0'/>", "<scale x='0'/><translate x='2'/>"};
	for (size_t i = 0; i < sizeof flat / sizeof *flat; i++) {
		static const char *const types[] = {"cube", "sphere", "instance"};
		for (size_t k = 0; k < 3; k++) {
			char xml[512], place[128];
			snprintf(xml, sizeof xml,
				 S "<shape type='shapegroup' id='g'><shape type='cube'/></shape>\n"
				   "<shape type='%s'>%s\n<transform name='to_world'>%s</transform></shape>" END,
				 types[k], k == 2 ? "<ref id='g'/>" : "", flat[i]);
			snprintf(
				place, sizeof place,
				"s.xml:2: <shape type=\"%s\">: to_world flattens the shape (it has no inverse): line 3",
				types[k]);
			expect_refused(xml, place);
		}
	}
	assert_int_equal(read_text(SHAPE("<scale y='1e-30'/>"), NULL), 0);
}

static void test_invalid_references_are_refused(void **state)
{
	(void)state;
	expect_refused(S "<bsdf type='diffuse' id='wall'/><shape type='cube'>\n<ref id='wal'/></shape>" END,
		       "s.xml:2: <ref>: there is no object with id \"wal\"; did you mean `wall`?");
	expect_refused(S "<shape type='cube'><ref/></shape>" END, "needs an attribute `id`");
	expect_refused(S "<bsdf type='twosided' id='a'><ref id='a'/></bsdf>" END, "refers to itself");
	expect_refused(
		S
		"<bsdf type='twosided' id='a'><ref id='b'/></bsdf><bsdf type='twosided' id='b'><ref id='a'/></bsdf>" END,
		"refers to itself");
	expect_refused(S "<bsdf type='diffuse' id='a'/>\n<bsdf type='diffuse' id='a'/>" END,
		       "s.xml:2: <bsdf type=\"diffuse\">: the id \"a\" is given twice");
	expect_refused(S "<alias id='a' as='b'/>" END, "there is no object with id \"a\"");
	expect_refused(S "<bsdf type='diffuse' id='a'/><alias id='a' as='a'/>" END, "given twice");
	expect_refused(S "<shape type='cube'><film type='hdrfilm'/></shape>" END,
		       "a film without a name has no place in <shape");
	expect_refused(S "<shape type='cube'><bsdf type='diffuse'/><bsdf type='diffuse'/></shape>" END,
		       "a second bsdf");
	expect_refused(S
		       "<bsdf type='diffuse' id='a'/><bsdf type='diffuse'><ref name='reflectance' id='a'/></bsdf>" END,
		       "`reflectance` may be a texture, but not a bsdf");
	expect_refused(S "<bsdf type='diffuse'><bsdf type='diffuse' name='nested'/></bsdf>" END, "has no `nested`");
}

/* Every name without a value is reported once, where it appears first. */
static void test_undefined_parameters_are_reported_once(void **state)
{
	(void)state;
	static const char xml[] =
		S "\n<default name='there' value='1'/><shape type='$kind'><float name='radius' value='$r'/>\n"
		  "<float name='x' value='$there'/><float name='y' value='$there$hte'/></shape><bsdf type='$r'/>\n"
		  "<include filename='$part.xml'/><bsdf type='twosided'><include filename='a/$part.xml'/></bsdf>" END;
	static const char *const said[] = {
		"s.xml:2: <shape>: attribute `type`: $kind is not defined",
		"s.xml:2: <float>: attribute `value`: $r is not defined by a <default> before this line; -D r=VALUE",
		"s.xml:3: <float>: attribute `value`: $hte is not defined",
		"s.xml:4: <include>: attribute `filename`: $part is not defined"};
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read_all(&s, &assets, "s.xml", scene_tables(), NULL, 0, false, &e), 0);
	assert_int_equal(s.problem_count, 4);
	for (size_t i = 0; i < 4; i++)
		if (strncmp(s.problems[i], said[i], strlen(said[i])) != 0)
			fail_msg("%s\n not: %s", s.problems[i], said[i]);
	scene_fini(&s);
}

/* An error in a medium is reported where the medium is defined, not wherever it is used. */
static void test_errors_in_shared_media_are_reported_once(void **state)
{
	(void)state;
	static const char xml[] = S "<medium type='smoke' id='fog'/><shape type='cube'><ref id='fog' name='interior'/>"
				    "</shape><shape type='sphere'><ref id='fog' name='exterior'/></shape>" END;
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read_all(&s, &assets, "s.xml", scene_tables(), NULL, 0, false, &e), 0);
	assert_int_equal(s.problem_count, 1);
	scene_fini(&s);
	assert_int_equal(scene_read_all(&s, &assets, "s.xml", scene_tables(), NULL, 0, true, &e), 0);
	assert_true(s.problem_count == 0 && s.note_count == 1);
	scene_fini(&s);
}

/* A shape may have a medium on each side, a camera may be in one, and an emitter need not state one. */
static void test_media_of_shapes_and_sensors_are_found(void **state)
{
	(void)state;
#define TEA \
	"<medium type='homogeneous' id='tea'><rgb name='sigma_s' value='0, 1, 0'/><rgb name='sigma_a' value='1, 2, 3'/>"
	static const char xml[] = S TEA "<phase type='hg'/></medium>"
					"<shape type='cube'><ref id='tea' name='interior'/></shape>"
					"<shape type='sphere'><emitter type='area'><ref id='tea'/></emitter></shape>"
					"<sensor type='perspective'><ref name='medium' id='tea'/></sensor>" END;
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	if (scene_read(&s, &assets, "s.xml", scene_tables(), NULL, 0, &e))
		fail_msg("%s", e.text);
	const struct scene_node *tea = node_ref(s.objects[1], "interior");
	assert_true(tea && tea->cls == PLUGIN_MEDIUM && node_find_property(tea, "sigma_a"));
	assert_string_equal(node_child(tea, PLUGIN_PHASE, 0)->type, "hg");
	assert_null(node_ref(s.objects[1], "exterior"));
	assert_ptr_equal(node_child(scene_sensor(&s, 1), PLUGIN_MEDIUM, 0), tea);
	scene_fini(&s);
	expect_refused(S TEA "</medium><sensor type='perspective'><ref id='tea'/><ref id='tea'/></sensor>" END,
		       "a second medium in <sensor type=\"perspective\">, which may have one");
	expect_refused("<scene version='0.6.0'><shape type='cube'>" TEA "</medium></shape>" END,
		       "a medium without a name has no place in <shape type=\"cube\">");
	expect_refused(S "<bsdf type='diffuse'>" TEA "</medium></bsdf>" END,
		       "a medium without a name has no place in <bsdf type=\"diffuse\">");
	expect_refused(S TEA "<float name='sigma' value='1'/></medium>" END,
		       "<medium type=\"homogeneous\"> has no `sigma`; did you mean `sigma_");
	expect_refused(S "<medium type='homogeneous'><phase type='hg'/><phase type='hg'/></medium>" END,
		       "a second phase in <medium type=\"homogeneous\">, which may have one");
}

/* test_scene.c tests which parameters count as those of a fork. */
static void test_misplaced_parameters_are_refused(void **state)
{
	(void)state;
	expect_refused(S "<sensor type='perspective'><float name='fovv' value='1'/></sensor>" END,
		       "did you mean `fov`?");
	expect_refused(S "<shape type='cube'><float name='radius' value='1'/></shape>" END, "has no `radius`");
	expect_refused(BSDF("<texture name='num_parameters' type='checkerboard'/>"), "has no `num_parameters`");
	expect_refused(S "<shape type='cube'><texture name='displacment' type='checkerboard'/></shape>" END,
		       "did you mean `displacement`?");
	expect_refused(S "<emitter type='area'><texture name='num_parameters' type='checkerboard'/></emitter>" END,
		       "has no `num_parameters`");
	expect_refused(BSDF("<rgb name='alpha' value='.1 .1 .2'/>"), "`alpha` cannot have this type");
	expect_refused(BSDF("<spectrum name='alpha' value='400:.1, 700:.2'/>"), "`alpha` cannot have this type");
	expect_refused(BSDF("<rgb name='alpha' value='2'/>"), "alpha=2 is outside");
}

static void test_invalid_spectrum_objects_are_refused(void **state)
{
	(void)state;
	static const char use[] = "<bsdf type='diffuse'><ref name='reflectance' id='s'/></bsdf>";
	char text[512];
	snprintf(text, sizeof text, S "<spectrum type='uniform' id='s'>\n<ref name='value' id='s'/></spectrum>%s" END,
		 use);
	expect_refused(text, "s.xml:2: <ref>: has no place in a spectrum of type `uniform`");
	snprintf(text, sizeof text, S "<spectrum value='1' id='s'/>\n%s" END, use);
	expect_refused(text, "s.xml:1: <spectrum>: has no place in <scene>");
	snprintf(text, sizeof text, S "<spectrum type='uniform' id='s'/><texture type='checkerboard' id='s'/>%s" END,
		 use);
	expect_refused(text, "the id \"s\" is given twice");
	snprintf(text, sizeof text, S "<spectrum type='unifrm' id='t'/>%s" END, use);
	expect_refused(
		text,
		"s.xml:1: <spectrum type=\"unifrm\">: there is no spectrum of this type; did you mean `uniform`?");
}

static void test_invalid_includes_are_refused(void **state)
{
	(void)state;
	expect_refused(S "\n<include filename='x.xml'/>" END, "s.xml:2: <include>: x.xml: no such file");
	expect_refused(S "<include/>" END, "needs filename");
	expect_refused(S "<bsdf type='diffuse'><include filename='s.xml'/></bsdf>" END, "more than 15 deep");
	expect_refused(S "<bsdf type='mask'><include filename='s.xml' nme='x'/></bsdf>" END, "has no attribute `nme`");
	expect_refused("<scene version='0.4.0'><bsdf type='mask'>\n<include filename='i.xml'/></bsdf>" END,
		       "s.xml:2: <include>: in files before 0.5 it must be directly in <scene>");
	expect_refused(S "<include filename='s.xml'/>" END, "files include each other more than 15 deep");
	static const char main_file[] = S "<include filename='i.xml'/>" END,
			  broken[] = S "\n\n<bsdf type='difuse'/>" END,
			  doctype[] = "<!DOCTYPE scene []><scene version='3.0.0'/>",
			  no_version[] = "<shape type='sphere'/>", no_object[] = "<spere version='3.0.0'/>",
			  inside[] = "<shape type='sphere' version='3.0.0'><include filename='i.xml'/></shape>",
			  in_object[] = S "<shape type='sphere'>\n<include filename='empty.xml'/></shape>" END;
	static const struct {
		const char *bytes, *text;
	} cases[] = {{broken, "i.xml:3: <bsdf type=\"difuse\">"},
		     {doctype, "i.xml:1: <!DOCTYPE>"},
		     {no_version, "i.xml:1: <shape type=\"sphere\">: needs a version, such as version="},
		     {no_object, "i.xml:1: <spere>: there is no element of this name"},
		     {inside, "files include each other more than 15 deep"},
		     {in_object, "i.xml:2: <include>: a file with a <scene> can only be included"}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		const struct memory_file files[] = {{"s.xml", main_file, sizeof main_file - 1},
						    {"i.xml", cases[i].bytes, strlen(cases[i].bytes)},
						    {"empty.xml", S END, strlen(S END)},
						    {0}};
		struct error e = {""};
		assert_true(read_files(files, &e) < 0);
		if (!strstr(e.text, cases[i].text))
			fail_msg("%s\n  not: %s", e.text, cases[i].text);
	}
}

static void test_invalid_films_are_refused(void **state)
{
	(void)state;
#define FILM(x) S "<sensor type='perspective'>\n<film type='hdrfilm'>" x "</film></sensor>" END
	expect_refused(FILM("<integer name='width' value='0'/>"), "s.xml:2: <integer>: width=0 is outside [1, 65536]");
	expect_refused(FILM("<integer name='height' value='1000000000'/>"), "height=1e+09 is outside");
	expect_refused(FILM("<integer name='width' value='-5'/>"), "outside");
	expect_refused(FILM("<integer name='width' value='99999999999999999999999'/>"), "is too large");
	expect_refused(FILM("<integer name='crop_width' value='0'/>"), "crop_width=0 is outside [1, 65536]");
	expect_refused(FILM("<string name='size' value='5'/>"), "would change the image and is not supported");
#undef FILM
}

/* Each allocation fails once; nothing may leak (the sanitizers would see it), crash, or look like success. */
static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='0.6.0'><default name='d' value='diffuse'/><include filename='i.xml'/>"
		"<texture type='bitmap' id='t'><string name='filename' value='a.png'/></texture>"
		"<bsdf type='$d' id='m'><ref name='reflectance' id='t'/></bsdf><alias id='m' as='k'/>"
		"<shape type='sphere'><ref id='k'/><transform name='toWorld'><scale value='2'/></transform>"
		"</shape></scene>";
	static const char good[] =
		"<scene version='0.6.0'><bsdf type='roughconductor'><spectrum name='eta' value='1:2,3:4'/>"
		"</bsdf></scene>";
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {"i.xml", good, sizeof good - 1}, {0}};
	long n = 0;
	struct error e = {""};
	int r;
	do {
		mem_fail_after(n++);
		r = read_files(files, &e);
		assert_true(r == 0 || r == -ENOMEM);
	} while (r && n < 10000);
	mem_fail_after(-1);
	assert_int_equal(r, 0);
	assert_true(n > 5);
}

/* Each missing file counts as a problem, once; existing files do not. */
static void test_missing_files_are_counted_once(void **state)
{
	(void)state;
	const char *xml = "<scene version='3.0.0'>\n<shape type='cone'/>\n"
			  "<shape type='obj'><string name='filename' value='a.obj'/></shape>\n"
			  "<shape type='obj'><string name='filename' value='there.obj'/></shape>\n"
			  "<shape type='obj'><string name='filename' value='b.obj'/></shape>\n"
			  "<shape type='obj'><string name='filename' value='a.obj'/></shape>\n</scene>";
	const struct memory_file memory[] = {{"s.xml", xml, strlen(xml)}, {"there.obj", "v 0 0 0\n", 8}, {0}};
	struct error e;
	assert_int_equal(read_files(memory, &e), -EINVAL);
	assert_non_null(strstr(e.text, "s.xml:2: <shape type=\"cone\">"));
	assert_non_null(strstr(e.text, "(and at least 2 more: hslt-scene check lists all)"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_malformed_files_are_refused),
		cmocka_unit_test(test_document_types_are_refused),
		cmocka_unit_test(test_growing_parameter_values_are_refused),
		cmocka_unit_test(test_nesting_depth_is_limited),
		cmocka_unit_test(test_nesting_depth_counts_across_included_files),
		cmocka_unit_test(test_number_of_elements_is_limited),
		cmocka_unit_test(test_unknown_names_get_suggestions),
		cmocka_unit_test(test_undefined_parameters_are_reported_once),
		cmocka_unit_test(test_errors_in_shared_media_are_reported_once),
		cmocka_unit_test(test_media_of_shapes_and_sensors_are_found),
		cmocka_unit_test(test_misplaced_parameters_are_refused),
		cmocka_unit_test(test_errors_name_outside_files_as_written),
		cmocka_unit_test(test_invalid_values_are_refused),
		cmocka_unit_test(test_invalid_transforms_are_refused),
		cmocka_unit_test(test_invalid_references_are_refused),
		cmocka_unit_test(test_flattening_transforms_are_refused),
		cmocka_unit_test(test_invalid_spectrum_objects_are_refused),
		cmocka_unit_test(test_invalid_includes_are_refused),
		cmocka_unit_test(test_missing_files_are_counted_once),
		cmocka_unit_test(test_invalid_films_are_refused),
		cmocka_unit_test(test_failed_allocations_are_reported),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
