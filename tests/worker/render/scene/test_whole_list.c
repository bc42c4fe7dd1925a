/* SPDX-License-Identifier: Apache-2.0 */
/*
 * scene_read_all() lists all problems of a scene in one run, without those that merely follow from others: names
 * without values, missing files, duplicate ids, unknown types, truncated includes. Uses of a missing name are not
 * reported again.
 */
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define S "<scene version='3.0.0'>"
#define END "</scene>"

/* Expects exactly the problems that begin with these texts; NULL ends the list. */
static void expect_problems(const struct memory_file *files, bool lenient, const char *const *expected)
{
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read_all(&s, &assets, files[0].name, render_plugins(), NULL, 0, lenient, &e), 0);
	for (uint32_t i = 0; i < s.problem_count; i++)
		if (!expected[i] || strncmp(s.problems[i], expected[i], strlen(expected[i])) != 0)
			fail_msg("%s\n not: %s", s.problems[i], expected[i] ? expected[i] : "none");
	if (expected[s.problem_count])
		fail_msg("not said: %s", expected[s.problem_count]);
	scene_fini(&s);
}

static void expect_problems_of_text(const char *xml, const char *const *expected)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	expect_problems(files, false, expected);
}

/* A value that contains an undefined name is not checked; everything else is. */
static void test_undefined_values_are_not_checked(void **state)
{
	(void)state;
	static const char xml[] =
		S "<default name='both' value='$a'/>\n"
		  "<shape type='sphere'><float name='radius' value='$both'/><float name='radios' value='$a'/>\n"
		  "<transform name='to_world'><translate x='$b'/><scale value='0'/></transform><ref id='$c'/>\n"
		  "<bsdf type='$kind'><float name='anything' value='1'/></bsdf></shape>\n"
		  "<alias id='$c' as='d'/><shape type='cube'><ref id='d'/><float name='$c' value='1'/></shape>\n"
		  "<bsdf type='bumpmap'><string name='filename' value='$a.png'/><bsdf type='diffus'/></bsdf>" END;
	static const char *const expected[] = {
		"s.xml:1: <default>: attribute `value`: $a is not defined",
		"s.xml:3: <translate>: attribute `x`: $b is not defined",
		"s.xml:3: <ref>: attribute `id`: $c is not defined",
		"s.xml:4: <bsdf>: attribute `type`: $kind is not defined",
		"s.xml:2: <float>: <shape type=\"sphere\"> has no `radios`; did you mean",
		"s.xml:6: <bsdf type=\"diffus\">: there is no bsdf of this type",
		NULL};
	expect_problems_of_text(xml, expected);
}

/* With an undefined search path, missing files are not reported: they might lie there. */
static void test_undefined_search_path_hides_missing_files(void **state)
{
	(void)state;
	static const char *const expected[] = {"s.xml:1: <path>: attribute `value`: $models is not defined", NULL};
	expect_problems_of_text(S "<path value='$models'/><shape type='spher'/>" END, expected);
}

/* The names and ids in missing files are unknown, so uses of unknown names and ids are not reported. */
static void test_missing_includes_hide_unknown_ids(void **state)
{
	(void)state;
	static const char xml[] =
		S "<include filename='gone.xml'/>\n<shape type='sphere'><ref id='gone'/><float name='radius' "
		  "value='$r'/></shape>\n<bsdf type='mask'><include filename='sub/gone.xml'/></bsdf>\n"
		  "<include filename='there.xml'/>" END;
	static const char there[] = S "<shape type='spher'/><include filename='gone2.xml'/>\n"
				      "<alias id='gone' as='another'/><shape type='cub'/>" END;
	const struct memory_file files[] = {
		{"s.xml", xml, sizeof xml - 1}, {"there.xml", there, sizeof there - 1}, {0}};
	static const char *const expected[] = {"s.xml:1: <include>: gone.xml",
					       "s.xml:3: <include>: sub/gone.xml",
					       "there.xml:1: <include>: gone2.xml",
					       "there.xml:1: <shape type=\"spher\">: there is no shape",
					       "there.xml:2: <shape type=\"cub\">: there is no shape",
					       NULL};
	expect_problems(files, false, expected);
}

/* A file that cannot be read to its end still gets the problems found before the error. */
static void test_problems_before_a_syntax_error_are_listed(void **state)
{
	(void)state;
	static const char *const expected[] = {"s.xml:1: <include>: gone.xml", "s.xml:2: mismatched tag in <shape>",
					       NULL};
	static const char *const unset[] = {"s.xml:1: <shape>: attribute `type`: $kind is not defined",
					    "s.xml:2: the file ends before </scene>", NULL};
	expect_problems_of_text(S "<include filename='gone.xml'/>\n<shape type='cube'></scene>", expected);
	expect_problems_of_text(S "<shape type='$kind'/>\n", unset);
}

/* An <include> element that is still open at the error was never read: in the scene, in an object, and as the first
 * element of a file. */
static void test_includes_open_at_a_syntax_error_are_not_read(void **state)
{
	(void)state;
	static const char *const expected[] = {"s.xml:1: not well-formed (invalid token) in <include>", NULL};
	static const char *const inner[] = {"i.xml:1: not well-formed (invalid token) in <include>", NULL};
	expect_problems_of_text(S "<include filename='i.xml'><b\xff", expected);
	expect_problems_of_text(S "<shape type='cube'><include filename='i.xml'><b\xff", expected);
	expect_problems_of_text(S "<include filename='i.xml'><bsdf type='diffuse'/><b\xff", expected);
	static const char outer[] = S "<include filename='i.xml'/>" END,
			  first[] = "<include filename='s.xml' version='3.0.0'><b\xff";
	const struct memory_file files[] = {
		{"s.xml", outer, sizeof outer - 1}, {"i.xml", first, sizeof first - 1}, {0}};
	expect_problems(files, false, inner);
}

/* Every duplicate id and every alias is reported; uses of an alias are not. */
static void test_duplicate_ids_and_bad_aliases_are_listed(void **state)
{
	(void)state;
	static const char xml[] =
		S "<bsdf type='diffuse' id='a'/><bsdf type='diffuse' id='b'/>\n"
		  "<bsdf type='diffuse' id='a'/>\n<bsdf type='diffuse' id='b'/>\n"
		  "<alias id='c' as='d'/><alias id='a' as='e'/><alias id='a' as='b'/>"
		  "<shape type='cube'><ref id='d'/></shape><shape type='cube'><ref id='e'/></shape>" END;
	static const char *const expected[] = {"s.xml:2: <bsdf type=\"diffuse\">: the id \"a\" is given twice",
					       "s.xml:3: <bsdf type=\"diffuse\">: the id \"b\" is given twice",
					       "s.xml:4: <alias>: there is no object with id \"c\"",
					       "s.xml:4: <alias>: the id \"b\" is given twice", NULL};
	expect_problems_of_text(xml, expected);
}

/* Objects inside a refused one are checked as well, once each. */
static void test_objects_in_refused_objects_are_checked(void **state)
{
	(void)state;
	static const char xml[] = S
		"<sensor type='distant'><float name='anything' value='x'/>\n<film type='hdrfilm'><integer name='widht' "
		"value='9'/>\n<integer name='width' value='0'/><rfilter type='gauss'/></film><sampler type='any'/></sensor>\n"
		"<shape type='rock'><ref id='nothing'/><ref id='dull'/>\n<bsdf type='mirorr'><bsdf "
		"type='diffus'/></bsdf></shape>\n<shape type='rock'><bsdf id='dull' type='dul'/></shape>" END;
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	static const char *const strict[] = {"s.xml:1: <sensor type=\"distant\">: this sensor of Mitsuba's",
					     "s.xml:1: <float>: `x` is not a (finite) number",
					     "s.xml:2: <integer>: <film type=\"hdrfilm\"> has no `widht`",
					     "s.xml:3: <integer>: width=0 is outside",
					     "s.xml:3: <rfilter type=\"gauss\">: there is no rfilter",
					     "s.xml:4: <shape type=\"rock\">: there is no shape of this type",
					     "s.xml:4: <ref>: there is no object with id \"nothing\"",
					     "s.xml:5: <bsdf type=\"mirorr\">: there is no bsdf of this type",
					     "s.xml:5: <bsdf type=\"diffus\">: there is no bsdf of this type",
					     "s.xml:6: <shape type=\"rock\">: there is no shape of this type",
					     "s.xml:6: <bsdf type=\"dul\">: there is no bsdf of this type",
					     NULL};
	expect_problems(files, false, strict);
	/* Objects that are left out may contain anything. */
	static const char *const lenient[] = {"s.xml:1: <sensor type=\"distant\">: this sensor of Mitsuba's",
					      "s.xml:1: <float>: `x` is not a (finite) number",
					      "s.xml:3: <integer>: width=0 is outside", NULL};
	expect_problems(files, true, lenient);
}

/* Each step is checked, and the attributes of <transform> itself, also in animations and textures. */
static void test_every_transform_step_is_checked(void **state)
{
	(void)state;
	static const char xml[] =
		S "<shape type='sphere'><transform name='to_world' nam='x'><translate x='a'/><scale value='2'/>\n"
		  "<rotate x='1'/>\n<skale value='2'/>\n<lookat origin='0,0,0' target='0,0,0'/></transform>\n"
		  "<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'><transform name='to_uv'>\n"
		  "<scale y='2' value='3'/>\n<matrix value='1 0'/></transform></texture></bsdf></shape>\n"
		  "<shape type='cube'><animation name='to_world'><transform time='0'><translate x='0'/></transform>\n"
		  "<transform time='1'><translate z='b'/>\n<translate z='c'/></transform>\n"
		  "<transform time='2'><translate w='1'/></transform></animation></shape>" END;
	static const char *const expected[] = {"s.xml:1: <transform>: has no attribute `nam`",
					       "s.xml:1: <translate>: x=\"a\" is not a (finite) number",
					       "s.xml:2: <rotate>: needs an angle in degrees",
					       "s.xml:3: <skale>: is not a transform; did you mean `scale`?",
					       "s.xml:4: <lookat>: origin and target are equal",
					       "s.xml:6: <scale>: needs either x, y, z or value",
					       "s.xml:7: <matrix>: needs value=",
					       "s.xml:9: <translate>: z=\"b\" is not a (finite) number",
					       "s.xml:10: <translate>: z=\"c\" is not a (finite) number",
					       "s.xml:11: <translate>: has no attribute `w`",
					       NULL};
	expect_problems_of_text(xml, expected);
	/* Each step is valid, but their product is not. */
	static const char *const product[] = {"s.xml:2: <scale>: the transform is out of range", NULL};
	expect_problems_of_text(
		S
		"<shape type='cube'><transform name='to_world'><scale value='1e30'/>\n<scale value='1e30'/></transform>"
		"</shape>" END,
		product);
}

/* The parameters of an unknown plug-in are unknown, but the notation of their values is checked. */
static void test_notation_of_unknown_parameters_is_checked(void **state)
{
	(void)state;
	static const char xml[] = S
		"<bsdf type='hair_of_a_fork'><float name='length' value='5cm'/><rgb name='tint' value='1 2'/>\n"
		"<boolean name='wet' value='yes'/><float name='anything' value='1'/><integer name='count' valu='3'/>\n"
		"<transform name='comb'><rotate x='1'/><translate x='p'/></transform><point name='p' x='1'/>\n"
		"<spectrum name='melanin' filename='gone.spd'/><float name='unset' value='$u'/></bsdf>" END;
	static const char *const expected[] = {"s.xml:4: <float>: attribute `value`: $u is not defined",
					       "s.xml:1: <bsdf type=\"hair_of_a_fork\">: there is no bsdf of this type",
					       "s.xml:1: <float>: `5cm` is not a (finite) number",
					       "s.xml:1: <rgb>: `1 2` is neither three numbers nor one",
					       "s.xml:2: <boolean>: `yes` is neither true nor false",
					       "s.xml:2: <integer>: has no attribute `valu`; did you mean `value`?",
					       "s.xml:3: <rotate>: needs an angle",
					       "s.xml:3: <translate>: x=\"p\" is not",
					       "s.xml:4: <spectrum>: gone.spd",
					       NULL};
	expect_problems_of_text(xml, expected);
}

/* The content of an unknown type is checked as that of the type it resembles, and elements of unknown names are
 * reported in any. */
static void test_misspelt_types_are_checked_as_intended(void **state)
{
	(void)state;
	static const char xml[] =
		S "<sensor type='perspectve'><flot name='fov' value='40'/>\n<float name='fv' value='3'/>\n"
		  "<float name='fov' value='200'/></sensor>\n"
		  "<shape type='sphere'><bsdf type='plstic'><float name='int_ir' value='2'/>\n"
		  "<texture name='diffuse_reflectance' type='checkerbord'><rgb name='color2' value='0.5'/></texture>"
		  "</bsdf></shape>\n<bsdf type='plstic' id='a'/>\n<bsdf type='of_a_fork'><flot name='x' value='1'/>\n"
		  "<default name='y' value='1'/></bsdf>" END;
	static const char *const expected[] = {
		"s.xml:1: <sensor type=\"perspectve\">: there is no sensor of this type; did you mean `perspective`? "
		"(its content is checked as that of `perspective`; supported: ",
		"s.xml:1: <flot>: there is no element of this name; did you mean `float`?",
		"s.xml:2: <float>: <sensor type=\"perspective\"> has no `fv`; did you mean `fov`?",
		"s.xml:3: <float>: fov=200 is outside",
		"s.xml:4: <bsdf type=\"plstic\">: there is no bsdf of this type; did you mean `plastic`?",
		"s.xml:4: <float>: <bsdf type=\"plastic\"> has no `int_ir`; did you mean `int_ior`?",
		"s.xml:5: <texture type=\"checkerbord\">: there is no texture of this type; did you mean `checkerboard`?",
		"s.xml:5: <rgb>: <texture type=\"checkerboard\"> has no `color2`",
		"s.xml:6: <bsdf type=\"plstic\">: there is no bsdf of this type; did you mean `plastic`? --lenient uses "
		"the bsdf inside it, or `diffuse`, instead (supported: ",
		"s.xml:7: <bsdf type=\"of_a_fork\">: there is no bsdf of this type",
		"s.xml:7: <flot>: there is no element of this name; did you mean `float`?",
		NULL};
	expect_problems_of_text(xml, expected);
}

/* Complete objects before the error in a truncated file are checked, open ones are not, and everything in the
 * including files is. */
static void test_complete_objects_of_broken_includes_are_checked(void **state)
{
	(void)state;
	static const char xml[] = S
		"<include filename='half.xml'/>\n<shape type='sphere'><ref id='lost'/><ref id='kept'/><float name='radius' "
		"value='r'/></shape>\n<bsdf type='mask'><include filename='inner.xml'/></bsdf>\n"
		"<include filename='old.xml'/><include filename='empty.xml'/>\n<shape type='cub'/></scenes>";
	static const char half[] = S "<bsdf type='diffus'/>\n<bsdf id='kept' type='twosided'><bsdf type='conduct'/>\n"
				     "</bsdf><shape type='cylindr'><float name='radios' value='1'></shape>" END;
	static const char inner[] = "<bsdf type='diffus' version='3.0.0'><float name='x' value='1'></bsdf>",
			  old[] = "<scene version='0.4.0'><luminaire type='are'/><shape>" END;
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1},
					    {"half.xml", half, sizeof half - 1},
					    {"inner.xml", inner, sizeof inner - 1},
					    {"old.xml", old, sizeof old - 1},
					    {"empty.xml", "", 0},
					    {0}};
	static const char *const expected[] = {"half.xml:3: mismatched tag in <float>",
					       "inner.xml:1: mismatched tag in <float>",
					       "old.xml:1: mismatched tag in <shape>",
					       "empty.xml: the file is empty",
					       "s.xml:5: mismatched tag in <scene>",
					       "half.xml:1: <bsdf type=\"diffus\">: there is no bsdf of this type",
					       "half.xml:2: <bsdf type=\"conduct\">: there is no bsdf of this type",
					       "s.xml:2: <float>: `r` is not a (finite) number",
					       "s.xml:5: <shape type=\"cub\">: there is no shape of this type",
					       NULL};
	expect_problems(files, false, expected);
}

/* An invalid node, mesh, light or camera of a glTF file does not hide others; each is reported once. */
static void test_every_problem_of_a_gltf_file_is_listed(void **state)
{
	(void)state;
	static const char gltf[] =
		"{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":[\"EXT_no_one_knows\"],\n"
		"\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"lamp\"}]}},\n"
		"\"scenes\":[{\"nodes\":[0,1,2,3,9,\"x\"]}],\n"
		"\"nodes\":[{\"mesh\":0,\"children\":[7]},\n{\"rotation\":[0,0,0,0],\"mesh\":5},\n"
		"{\"camera\":0,\"mesh\":0,\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},\n"
		"{\"children\":[3]}],\n"
		"\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":\"wide\"}}],\n"
		"\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorFactor\":[1]}}],\n"
		"\"meshes\":[{\"primitives\":[{\"attributes\":{\"NORMAL\":0}},"
		"{\"attributes\":{\"POSITION\":0},\"material\":0},{\"mode\":9},"
		"{\"attributes\":{\"POSITION\":4}}]}],\n"
		"\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],\n"
		"\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\n"
		"\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":36}]}";
	static const unsigned char bytes[36] = {0};
	const struct memory_file files[] = {{"s.gltf", gltf, sizeof gltf - 1}, {"b.bin", bytes, sizeof bytes}, {0}};
	static const char *const expected[] = {"s.gltf: it requires the extension EXT_no_one_knows",
					       "s.gltf:10: meshes[0]: a primitive has no POSITION",
					       "s.gltf:9: materials[0]: \"baseColorFactor\" is not an array of 4",
					       "s.gltf:10: meshes[0]: a primitive without attributes, or of mode 9",
					       "s.gltf: there is no accessors[4]",
					       "s.gltf: there is no nodes[7]",
					       "s.gltf:5: nodes[1]: its rotation is not a quaternion",
					       "s.gltf: there is no meshes[5]",
					       "s.gltf:8: cameras[0]: \"yfov\" is not a number",
					       "s.gltf:1: lights[0]: a light of type \"lamp\"",
					       "s.gltf:7: nodes[3]: it is its own ancestor",
					       "s.gltf: there is no nodes[9]",
					       "s.gltf:3: scenes[0]: its nodes are not indices",
					       NULL};
	expect_problems(files, false, expected);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_undefined_values_are_not_checked),
		cmocka_unit_test(test_undefined_search_path_hides_missing_files),
		cmocka_unit_test(test_missing_includes_hide_unknown_ids),
		cmocka_unit_test(test_duplicate_ids_and_bad_aliases_are_listed),
		cmocka_unit_test(test_objects_in_refused_objects_are_checked),
		cmocka_unit_test(test_problems_before_a_syntax_error_are_listed),
		cmocka_unit_test(test_includes_open_at_a_syntax_error_are_not_read),
		cmocka_unit_test(test_every_transform_step_is_checked),
		cmocka_unit_test(test_notation_of_unknown_parameters_is_checked),
		cmocka_unit_test(test_misspelt_types_are_checked_as_intended),
		cmocka_unit_test(test_every_problem_of_a_gltf_file_is_listed),
		cmocka_unit_test(test_complete_objects_of_broken_includes_are_checked),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
