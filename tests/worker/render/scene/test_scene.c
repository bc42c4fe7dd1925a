/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The scene language: values and spectra, transforms, defaults and parameters, includes, references and aliases, in
 * both dialects (0.6 and 3.x). Unknown or ignored features are noted once, with their place. File names are tested in
 * test_scene_files.c, refused files in test_bad_scenes.c.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "tests/support/scene_tables.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
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

/* Reads a scene with one element around `content`, such as <bsdf type="roughconductor">. */
static struct scene read_wrapped(const char *version, const char *begin, const char *content, const char *end)
{
	char xml[4096];
	snprintf(xml, sizeof xml, "<scene version=\"%s\">%s%s%s</scene>", version, begin, content, end);
	return read_valid(xml);
}

static struct scene read_bsdf(const char *version, const char *content)
{
	return read_wrapped(version, "<bsdf type=\"roughconductor\">", content, "</bsdf>");
}

static void assert_rgb(const struct scene *s, double r, double g, double b)
{
	const struct property *p = node_find_property(s->objects[0], "eta");
	assert_non_null(p);
	assert_int_equal(p->value.type, VALUE_RGB);
	const double want[3] = {r, g, b};
	for (int i = 0; i < 3; i++)
		if (!(fabs(p->value.as.rgb[i] - want[i]) < 1e-12))
			fail_msg("component %d is %.17g, not %.17g", i, p->value.as.rgb[i], want[i]);
}

static void test_rgb_notations_are_read(void **state)
{
	(void)state;
	static const struct {
		const char *version, *element;
		double r, g, b;
	} cases[] = {
		{"3.0.0", "<rgb name='eta' value='0.1, 0.2, 0.3'/>", .1, .2, .3},
		{"0.6.0", "<rgb name='eta' value='.1 .2 .3'/>", .1, .2, .3},
		{"0.6.0", "<rgb name='eta' value='.73'/>", .73, .73, .73},
		{"0.6.0", "<srgb name='eta' value='#ff8000'/>", 1, 0.21586050011389926, 0},
		{"0.6.0", "<rgb name='eta' value='#ff8000'/>", 1, 128 / 255.0, 0},
		{"3.0.0", "<srgb name='eta' value='0.5, 0, 1'/>", 0.21404114048223255, 0, 1},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct scene s = read_bsdf(cases[i].version, cases[i].element);
		assert_rgb(&s, cases[i].r, cases[i].g, cases[i].b);
		scene_fini(&s);
	}
}

static void test_sampled_spectra_are_read(void **state)
{
	(void)state;
	struct scene s = read_bsdf("3.0.0", "<spectrum name='eta' value='400:0.5, 500:1.5 ,600:2e0'/>"
					    "<spectrum name='k' value='0.25'/>");
	const struct value *eta = &node_find_property(s.objects[0], "eta")->value,
			   *k = &node_find_property(s.objects[0], "k")->value;
	assert_int_equal(eta->type, VALUE_SPECTRUM);
	assert_int_equal(eta->as.spectrum.count, 3);
	assert_true(eta->as.spectrum.nm[1] == 500 && eta->as.spectrum.value[2] == 2);
	assert_int_equal(k->as.spectrum.count, 1);
	assert_true(k->as.spectrum.value[0] == 0.25);
	scene_fini(&s);
}

static void test_points_numbers_and_booleans_are_read(void **state)
{
	(void)state;
	struct scene s = read_wrapped("0.6.0", "<shape type='sphere'>",
				      "<point name='center' x='1' z='-3'/><float name='radius' value='2'/>"
				      "<boolean name='flipNormals' value='true'/>",
				      "</shape>");
	const struct scene_node *n = s.objects[0];
	vec3 c = node_find_property(n, "center")->value.as.point;
	assert_true(c.x == 1 && c.y == 0 && c.z == -3);
	assert_true(node_float(n, "radius", 0) == 2);
	assert_true(node_bool(n, "flip_normals", false));
	assert_int_equal(node_int(n, "absent", 7), 7);
	assert_string_equal(node_string(n, "absent", "fallback"), "fallback");
	scene_fini(&s);
	s = read_wrapped("3.0.0", "<shape type='sphere'>",
			 "<point name='center' value='1, 2, 3'/><integer name='radius' value='2'/>", "</shape>");
	assert_true(node_find_property(s.objects[0], "center")->value.as.point.z == 3);
	assert_int_equal(node_find_property(s.objects[0], "radius")->value.type, VALUE_FLOAT);
	scene_fini(&s);
	s = read_wrapped("3.0.0", "<shape type='sphere'>", "<point name='center' value='0.5'/>", "</shape>");
	c = node_find_property(s.objects[0], "center")->value.as.point;
	assert_true(c.x == 0.5 && c.y == 0.5 && c.z == 0.5);
	scene_fini(&s);
}

static void check_transform_in(const char *version, const char *content, vec3 p, vec3 want)
{
	char all[1024];
	snprintf(all, sizeof all, "<transform name='%s'>%s</transform>", *version == '0' ? "toWorld" : "to_world",
		 content);
	struct scene s = read_wrapped(version, "<shape type='cube'>", all, "</shape>");
	mat4 m = node_transform(s.objects[0], "to_world");
	vec3 d = vec3_sub(mat4_point(&m, p), want);
	if (!(vec3_length(d) < 1e-12))
		fail_msg("%s is off by (%g, %g, %g)", content, d.x, d.y, d.z);
	for (int i = 0; i < 4; i++)
		assert_true(m.m[3][i] == (i == 3));
	scene_fini(&s);
}

static void check_transform(const char *content, vec3 p, vec3 want)
{
	check_transform_in("0.6.0", content, p, want);
}

static void test_transform_steps_apply_in_order(void **state)
{
	(void)state;
	vec3 p = {1, 2, 3};
	check_transform("", p, p);
	check_transform("<translate x='1' z='-1'/>", p, (vec3){2, 2, 2});
	check_transform("<translate value='1 2 3'/>", p, (vec3){2, 4, 6});
	check_transform_in("3.0.0", "<translate value='2'/>", p, (vec3){3, 4, 5});
	check_transform("<scale value='2'/>", p, (vec3){2, 4, 6});
	check_transform("<scale x='151' z='60' y='1'/>", p, (vec3){151, 2, 180});
	check_transform("<scale x='3'/>", p, (vec3){3, 2, 3});
	check_transform("<scale value='1, 2, 3'/>", p, (vec3){1, 4, 9});
	check_transform("<rotate z='1' angle='90'/>", p, (vec3){-2, 1, 3});
	check_transform("<rotate value='0, 0, 1' angle='90'/>", p, (vec3){-2, 1, 3});
	check_transform("<rotate x='0' y='0' z='0' angle='0'/>", p, p);
	check_transform("<matrix value='1 0 0 10 0 0 1 20 0 -1 0 30 0 0 0 1'/>", p, (vec3){11, 23, 28});
	check_transform("<matrix value='1 0 0 10 0 0 1 20 0 -1 0 30 -0 1e-9 0 1.000000238418579'/>", p,
			(vec3){11, 23, 28});
	check_transform("<matrix value='0 1 0, 0 0 1, 1 0 0'/>", p, (vec3){2, 3, 1});
	/* Steps apply in the order in which they are written. */
	check_transform("<scale value='2'/><translate x='1'/>", p, (vec3){3, 4, 6});
	check_transform("<translate x='1'/><scale value='2'/>", p, (vec3){4, 4, 6});
	check_transform("<translate x='1'/><rotate z='1' angle='90'/>", p, (vec3){-2, 2, 3});
	check_transform("<lookAt origin='0,0,5' target='0,0,4' up='0 1 0'/>", (vec3){0, 0, 1}, (vec3){0, 0, 4});
	check_transform("<look_at origin='0,0,5' target='0,0,4' up='0 1 0'/>", (vec3){0, 0, 1}, (vec3){0, 0, 4});
	check_transform("<lookat origin='0,0,5' target='0,0,4' up='0 1 0'/>", (vec3){1, 0, 0}, (vec3){-1, 0, 5});
	/* The direction of +y without `up`, computed by hand from the documentation of each Mitsuba version. */
	vec3 y = {0, 1, 0};
	check_transform("<lookat origin='0,0,5' target='0,0,9'/>", y, (vec3){1, 0, 5});
	check_transform("<lookat origin='0,0,0' target='3,0,4'/>", y, (vec3){0, -1, 0});
	check_transform("<lookat origin='0,0,0' target='0,3,4' up='0,0,0'/>", y, (vec3){1, 0, 0});
	check_transform_in("3.0.0", "<lookat origin='0,0,5' target='0,0,9'/>", y, (vec3){1, 0, 5});
	check_transform_in("3.0.0", "<lookat origin='0,0,0' target='3,0,4'/>", y, (vec3){0.8, 0, -0.6});
	check_transform_in("3.0.0", "<lookat origin='0,0,0' target='3,0,-4'/>", y, (vec3){0.8, 0, 0.6});
}

static void test_names_follow_the_dialect_of_the_file(void **state)
{
	(void)state;
	struct scene s = read_bsdf("0.5.0", "<float name='extEta' value='1'/>");
	assert_false(s.is_dialect_3);
	assert_true(node_float(s.objects[0], "ext_eta", 0) == 1);
	scene_fini(&s);
	s = read_bsdf("2.1.0", "<float name='ext_eta' value='1'/>");
	assert_true(s.is_dialect_3);
	scene_fini(&s);
	/* 3.x does not know the old names. */
	struct error e;
	assert_int_equal(
		read_with_defines(&s,
				  "<scene version='3.0.0'><bsdf type='roughconductor'><float name='extEta' value='1'/>"
				  "</bsdf></scene>",
				  NULL, 0, &e),
		-EINVAL);
	assert_non_null(strstr(e.text, "did you mean `ext_eta`?"));
}

/* Names in each file follow the version of that file; the names of both dialects have the meaning of 3.x. */
static void test_files_of_both_dialects_can_be_combined(void **state)
{
	(void)state;
	static const char metal_6[] =
		"<scene version='0.4.0'><bsdf type='roughconductor'><float name='extEta' value='2'/>"
		"</bsdf></scene>",
			  metal_3[] =
				  "<scene version='3.0.0'><bsdf type='roughconductor'><float name='ext_eta' value='2'/>"
				  "</bsdf></scene>";
	for (int old = 0; old < 2; old++) {
		files[1] = old ? (struct memory_file){"m.xml", metal_6, sizeof metal_6 - 1}
			       : (struct memory_file){"m.xml", metal_3, sizeof metal_3 - 1};
		char xml[512];
		snprintf(xml, sizeof xml,
			 "<scene version='%s'><include filename='m.xml'/><include filename='m.xml'/>"
			 "<bsdf type='roughconductor'><float name='%s' value='3'/></bsdf></scene>",
			 old ? "3.0.0" : "0.4.0", old ? "ext_eta" : "extEta");
		struct scene s = read_valid(xml);
		assert_true(s.is_dialect_3);
		assert_int_equal(s.object_count, 3);
		assert_true(node_float(s.objects[0], "ext_eta", 0) == 2);
		assert_true(node_float(s.objects[2], "ext_eta", 0) == 3);
		assert_int_equal(s.note_count, 1);
		assert_non_null(strstr(s.notes[0], "s.xml: includes a file of another dialect"));
		scene_fini(&s);
	}
	files[1] = (struct memory_file){0};
}

/* A file may contain one object without a <scene> around it, which is read like any other object. */
static void test_included_file_may_be_a_single_object(void **state)
{
	(void)state;
	static const char metal[] = "<bsdf type='roughconductor' id='m' version='3.0.0'><float name='ext_eta' "
				    "value='2'/></bsdf>";
	files[1] = (struct memory_file){"m.xml", metal, sizeof metal - 1};
	struct scene s = read_valid("<scene version='3.0.0'><shape type='sphere'><ref id='m'/></shape>"
				    "<include filename='m.xml'/></scene>");
	assert_int_equal(s.object_count, 2);
	assert_true(node_float(s.objects[1], "ext_eta", 0) == 2);
	assert_ptr_equal(node_child(s.objects[0], PLUGIN_BSDF, 0), s.objects[1]);
	scene_fini(&s);
	files[1] = (struct memory_file){0};
}

static void test_capitals_in_type_names_are_ignored(void **state)
{
	(void)state;
	struct scene s =
		read_valid("<scene version='2.0.0'><shape type='Sphere'/><bsdf type='RoughConductor'/></scene>");
	assert_string_equal(s.objects[0]->type, "sphere");
	assert_string_equal(s.objects[1]->type, "roughconductor");
	scene_fini(&s);
}

/* Parameters added by forks of Mitsuba are noted and have no effect. */
static void test_parameters_of_forks_are_noted(void **state)
{
	(void)state;
	struct scene s = read_valid(
		"<scene version='3.0.0'>\n<sensor type='perspective'>\n<vector name='min_bounds' value='?'/></sensor>\n"
		"<shape type='sphere'><integer name='num_parameters' value='5'/></shape>\n"
		"<shape type='sphere'><integer name='num_parameters' value='5'/></shape>\n</scene>");
	assert_int_equal(s.note_count, 3); /* one of them says that there is no light */
	assert_string_equal(s.notes[0],
			    "s.xml:3: <sensor type=\"perspective\">: `min_bounds` is not known and is ignored");
	assert_string_equal(s.notes[1],
			    "s.xml:4: <shape type=\"sphere\">: `num_parameters` is not known and is ignored");
	for (uint32_t i = 0; i < s.object_count; i++)
		assert_int_equal(s.objects[i]->property_count, 0);
	scene_fini(&s);
}

/* In Mitsuba 3, textures of any name are attributes of a shape; nothing in these scenes uses them. */
static void test_textures_of_shapes_may_have_any_name(void **state)
{
	(void)state;
	struct scene s =
		read_valid("<scene version='3.0.0'><texture type='checkerboard' id='t'/>\n<shape type='sphere'>"
			   "<texture type='checkerboard' name='heat'/></shape>\n"
			   "<shape type='cube'><ref name='vertex_wear' id='t'/></shape></scene>");
	assert_true(scene_has_note(&s, "s.xml:2: <shape type=\"sphere\">: `heat` is not known and is ignored"));
	assert_true(scene_has_note(&s, "s.xml:3: <shape type=\"cube\">: `vertex_wear` is not known and is ignored"));
	scene_fini(&s);
}

/* A file of a version that does not exist yet is read as one of version 3. */
static void test_newer_versions_are_read_as_version_3(void **state)
{
	(void)state;
	struct scene s = read_valid("<scene version='9.0.0'><shape type='sphere'/></scene>");
	assert_true(scene_has_note(
		&s, "s.xml: version=\"9.0.0\" in s.xml:1 is newer than any known: read as by Mitsuba 3"));
	scene_fini(&s);
	s = read_valid("<scene version='3.9'><shape type='sphere'/></scene>");
	assert_false(scene_has_note(&s, "newer"));
	scene_fini(&s);
}

/* Groups without shapes are noted, once for each type. */
static void test_empty_groups_are_noted_once(void **state)
{
	(void)state;
	struct scene s = read_valid("<scene version='3.0.0'><shape type='merge'/>\n<shape type='merge'/>"
				    "<shape type='shapegroup' id='g'/></scene>");
	assert_true(scene_has_note(&s, "s.xml:1: <shape type=\"merge\"> holds no shape: nothing of it is seen"));
	assert_false(scene_has_note(&s, "s.xml:2: <shape type=\"merge\">"));
	assert_true(scene_has_note(&s, "s.xml:2: <shape type=\"shapegroup\"> holds no shape"));
	scene_fini(&s);
	s = read_valid("<scene version='3.0.0'><shape type='merge'><shape type='sphere'/></shape></scene>");
	assert_false(scene_has_note(&s, "holds no shape"));
	scene_fini(&s);
}

static void test_grey_colours_are_accepted_as_numbers(void **state)
{
	(void)state;
	static const char *const given[] = {"<rgb name='alpha' value='.25 .25 .25'/>",
					    "<rgb name='alpha' value='.25'/>", "<spectrum name='alpha' value='.25'/>"};
	for (int i = 0; i < 3; i++) {
		struct scene s = read_bsdf("3.0.0", given[i]);
		assert_int_equal(node_find_property(s.objects[0], "alpha")->value.type, VALUE_FLOAT);
		assert_true(node_float(s.objects[0], "alpha", 0) == .25);
		scene_fini(&s);
	}
}

/* If a texture is given for a parameter that must be a number, lenient reading keeps the default. */
static void test_lenient_reading_drops_textures_of_numbers(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='3.0.0'>\n<bsdf type='roughconductor'><texture name='alpha' type='checkerboard'/>"
		"<float name='ext_eta' value='2'/></bsdf></scene>";
	struct scene s;
	struct error e;
	assert_int_equal(read_with_defines(&s, xml, NULL, 0, &e), -EINVAL);
	struct asset_source assets = memory_assets(files);
	assert_int_equal(scene_read_lenient(&s, &assets, "s.xml", scene_tables(), NULL, 0, &e), 0);
	assert_null(node_find_property(s.objects[0], "alpha"));
	assert_true(node_float(s.objects[0], "ext_eta", 0) == 2);
	assert_int_equal(s.note_count, 1);
	assert_non_null(
		strstr(s.notes[0], "an object for the parameter `alpha` is not supported and left out (lenient)"));
	scene_fini(&s);
}

static void test_nested_and_referenced_objects_are_found(void **state)
{
	(void)state;
	struct scene s = read_valid(
		"<scene version='3.0.0'>"
		"<texture type='bitmap' id='t'><string name='filename' value='a/b.png'/></texture>"
		"<bsdf type='twosided' id='m'><bsdf type='diffuse'><ref name='reflectance' id='t'/></bsdf></bsdf>"
		"<shape type='cube'><ref id='m'/><emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>"
		"<shape type='rectangle'><ref id='m'/></shape>"
		"<shape type='rectangle'><bsdf type='diffuse'><texture type='checkerboard' name='reflectance'>"
		"<rgb name='color0' value='1'/><ref id='t' name='color1'/></texture></bsdf></shape>"
		"<spectrum type='bitmap' id='s'><string name='filename' value='a/b.png'/></spectrum>"
		"<shape type='cube'><bsdf type='diffuse'><ref name='reflectance' id='s'/></bsdf></shape>"
		"</scene>");
	assert_int_equal(s.object_count, 7);
	assert_ptr_equal(node_ref(node_child(s.objects[6], PLUGIN_BSDF, 0), "reflectance"), s.objects[5]);
	const struct scene_node *t = s.objects[0], *m = s.objects[1], *cube = s.objects[2];
	assert_string_equal(m->id, "m");
	const struct scene_node *diffuse = node_child(m, PLUGIN_BSDF, 0);
	assert_ptr_equal(node_ref(diffuse, "reflectance"), t);
	assert_ptr_equal(node_child(cube, PLUGIN_BSDF, 0), m);
	assert_ptr_equal(node_child(s.objects[3], PLUGIN_BSDF, 0), m);
	assert_string_equal(node_child(cube, PLUGIN_EMITTER, 0)->type, "area");
	assert_null(node_child(cube, PLUGIN_EMITTER, 1));
	const struct scene_node *checker = node_ref(node_child(s.objects[4], PLUGIN_BSDF, 0), "reflectance");
	assert_ptr_equal(node_ref(checker, "color1"), t);
	assert_int_equal(s.asset_count, 1);
	assert_string_equal(s.assets[0], "a/b.png");
	scene_fini(&s);
}

static void test_forward_references_and_aliases_are_resolved(void **state)
{
	(void)state;
	struct scene s =
		read_valid("<scene version='3.0.0'><shape type='cube'><ref id='other'/></shape>"
			   "<bsdf type='diffuse' id='m'/><alias id='m' as='other'/><alias id='other' as='third'/>"
			   "<shape type='cube'><ref id='third'/></shape></scene>");
	assert_ptr_equal(node_child(s.objects[0], PLUGIN_BSDF, 0), s.objects[1]);
	assert_ptr_equal(node_child(s.objects[2], PLUGIN_BSDF, 0), s.objects[1]);
	scene_fini(&s);
}

static void test_defines_override_defaults(void **state)
{
	(void)state;
	const char *xml = "<scene version='3.0.0'><default name='a' value='0.25'/><default name='dir' value='x$a'/>"
			  "<bsdf type='roughconductor'><float name='alpha' value='$a'/></bsdf>"
			  "<texture type='bitmap'><string name='filename' value='$dir/$a.png'/></texture></scene>";
	struct scene s = read_valid(xml);
	assert_true(node_float(s.objects[0], "alpha", 0) == 0.25);
	assert_string_equal(s.assets[0], "x0.25/0.25.png");
	scene_fini(&s);
	struct scene_define d[] = {{"a", "0.5"}, {"dir", "y"}};
	struct error e;
	assert_int_equal(read_with_defines(&s, xml, d, 2, &e), 0);
	assert_true(node_float(s.objects[0], "alpha", 0) == 0.5);
	assert_string_equal(s.assets[0], "y/0.5.png");
	scene_fini(&s);
	struct scene_define wrong[] = {{"aa", "0.5"}};
	assert_int_equal(read_with_defines(&s, xml, wrong, 1, &e), -EINVAL);
	assert_non_null(strstr(e.text, "did you mean `a`?"));
}

static void test_included_objects_and_defaults_are_shared(void **state)
{
	(void)state;
	static const char inner[] = "<scene version='3.0.0'><default name='x' value='diffuse'/>"
				    "<bsdf type='$x' id='m'/></scene>";
	files[1] = (struct memory_file){"parts/m.xml", inner, sizeof inner - 1};
	struct scene s = read_valid("<scene version='3.0.0'><shape type='cube'><ref id='m'/></shape>"
				    "<include filename='parts/m.xml'/><bsdf type='$x'/></scene>");
	assert_int_equal(s.object_count, 3);
	assert_string_equal(s.objects[1]->file, "parts/m.xml");
	assert_string_equal(s.objects[2]->file, "s.xml");
	assert_string_equal(s.objects[2]->type, "diffuse");
	assert_ptr_equal(node_child(s.objects[0], PLUGIN_BSDF, 0), s.objects[1]);
	assert_int_equal(s.asset_count, 1);
	assert_string_equal(s.assets[0], "parts/m.xml");
	scene_fini(&s);
	files[1] = (struct memory_file){0};
}

/* An <include> inside an object: two files deep, and used twice. */
static void test_objects_may_contain_includes(void **state)
{
	(void)state;
	static const char inner[] = "<bsdf type='twosided' version='3.0.0'><include filename='parts/n.xml'/></bsdf>",
			  innermost[] = "<bsdf type='phong' id='p' version='3.0.0'/>";
	files[1] = (struct memory_file){"parts/m.xml", inner, sizeof inner - 1};
	files[2] = (struct memory_file){"parts/n.xml", innermost, sizeof innermost - 1};
	struct scene s =
		read_valid("<scene version='3.0.0'><shape type='cube'><float name='displacement' value='1'/>"
			   "<include filename='parts/m.xml'/></shape><shape type='sphere'><ref id='p'/></shape>"
			   "</scene>");
	assert_int_equal(s.object_count, 2);
	const struct scene_node *sides = node_child(s.objects[0], PLUGIN_BSDF, 0);
	assert_string_equal(sides->type, "twosided");
	assert_string_equal(sides->file, "parts/m.xml");
	const struct scene_node *phong = node_child(sides, PLUGIN_BSDF, 0);
	assert_string_equal(phong->file, "parts/n.xml");
	assert_ptr_equal(node_child(s.objects[1], PLUGIN_BSDF, 0), phong);
	assert_int_equal(s.asset_count, 2);
	scene_fini(&s);
	files[1] = files[2] = (struct memory_file){0};
}

static void test_escaped_dollar_is_literal(void **state)
{
	(void)state;
	struct scene s = read_valid("<scene version='3.0.0'><default name='x' value='y'/>"
				    "<bsdf type='diffuse' id='a\\$x $x \\\\$x\\'/></scene>");
	assert_string_equal(s.objects[0]->id, "a$x y \\$x\\");
	scene_fini(&s);
}

static void test_ignored_elements_are_noted_once(void **state)
{
	(void)state;
	struct scene s = read_valid(
		"<scene version='0.5.0'>\n<mode type='x'><junk/>words</mode><mode/>\n"
		"<integrator type='unheard'><float name='q' value='nan'/><integer name='maxDepth' value='7'/>"
		"<junk/></integrator>\n"
		"<bsdf type='roughdielectric'><boolean name='sampleVisible' value='?'/></bsdf>\n"
		"<bsdf type='roughdielectric'><boolean name='sampleVisible' value='?'/></bsdf>\n"
		"<dpt/></scene>");
	assert_int_equal(s.note_count, 5);
	assert_string_equal(s.notes[0], "s.xml:2: <mode> is ignored with its contents");
	assert_string_equal(
		s.notes[1],
		"s.xml:3: <integrator type=\"unheard\"> is ignored except for: max_depth, rr_depth, hide_emitters; "
		"ignored here: `q`");
	assert_non_null(strstr(s.notes[2], "s.xml:4: <bsdf type=\"roughdielectric\">: `sampleVisible`"));
	assert_non_null(strstr(s.notes[3], "s.xml:6: <dpt>"));
	assert_non_null(strstr(s.notes[4], "s.xml:3: <integrator type=\"unheard\">: is not known"));
	assert_int_equal(node_int(s.objects[0], "max_depth", 0), 7);
	assert_int_equal(s.objects[0]->property_count, 1);
	scene_fini(&s);
}

static void test_depths_beyond_the_limit_are_noted(void **state)
{
	(void)state;
	struct scene s =
		read_valid("<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='129'/>"
			   "</integrator></scene>");
	assert_int_equal(s.note_count, 2);
	assert_non_null(strstr(s.notes[1], "max_depth 129 becomes 128"));
	scene_fini(&s);
	s = read_valid("<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='128'/>"
		       "</integrator></scene>");
	assert_int_equal(s.note_count, 1);
	scene_fini(&s);
}

/* All errors are listed, each with its place; an object that cannot be read is listed once. */
static void test_every_problem_is_listed_with_its_place(void **state)
{
	(void)state;
	const char *xml =
		"<scene version='3.0.0'>\n<bsdf type='irawan' id='fur'/>\n<shape type='cube'><ref id='fur'/>\n"
		"<float name='radius' value='1'/></shape>\n<shape type='cube'><ref id='fur'/></shape>\n<shape type='cone'/>\n</scene>";
	static const char *const want[] = {"s.xml:2: <bsdf type=\"irawan\">", "s.xml:4: <float>",
					   "s.xml:6: <shape type=\"cone\">"};
	const struct memory_file memory[] = {{"s.xml", xml, strlen(xml)}, {0}};
	struct asset_source assets = memory_assets(memory);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read_all(&s, &assets, "s.xml", scene_tables(), NULL, 0, false, &e), 0);
	assert_int_equal(s.problem_count, 3);
	for (uint32_t i = 0; i < 3; i++)
		if (strncmp(s.problems[i], want[i], strlen(want[i])) != 0)
			fail_msg("problem %u: %s\n not: %s", i, s.problems[i], want[i]);
	assert_int_equal(s.object_count, 2); /* the cubes, with their readable properties */
	scene_fini(&s);
	assert_int_equal(scene_read(&s, &assets, "s.xml", scene_tables(), NULL, 0, &e), -EINVAL);
	assert_non_null(strstr(e.text, want[0]));
	assert_non_null(strstr(e.text, "(and at least 2 more: hslt-scene check lists all)"));
}

/* 0.6 has two names for the colour of a diffuse surface; 3.x has one. */
static void test_second_name_of_reflectance_is_read_in_0_6(void **state)
{
	(void)state;
	struct scene s = read_valid("<scene version='0.6.0'><bsdf type='diffuse'><texture name='diffuseReflectance' "
				    "type='checkerboard'/></bsdf><bsdf type='diffuse'>"
				    "<rgb name='diffuseReflectance' value='0.1 0.2 0.3'/></bsdf></scene>");
	assert_non_null(node_ref(s.objects[0], "reflectance"));
	assert_true(node_find_property(s.objects[1], "reflectance")->value.as.rgb[2] == 0.3);
	scene_fini(&s);
	/* With a value and a texture, the texture counts in 0.6, in either order. */
	s = read_valid(
		"<scene version='0.6.0'><bsdf type='diffuse'><texture name='reflectance' type='checkerboard'/>"
		"<spectrum name='reflectance' value='0.5'/></bsdf><bsdf type='diffuse'>"
		"<spectrum name='reflectance' value='0.5'/><texture name='reflectance' type='checkerboard'/></bsdf></scene>");
	for (int i = 0; i < 2; i++)
		assert_true(node_ref(s.objects[i], "reflectance") && s.objects[i]->property_count == 1);
	scene_fini(&s);
	struct error e;
	assert_true(read_with_defines(&s,
				      "<scene version='3.0.0'><bsdf type='diffuse'><rgb name='reflectance' value='1'/>"
				      "<texture name='reflectance' type='checkerboard'/></bsdf></scene>",
				      NULL, 0, &e) < 0);
	assert_true(read_with_defines(&s,
				      "<scene version='0.6.0'><bsdf type='diffuse'><rgb name='reflectance' value='1'/>"
				      "<rgb name='diffuseReflectance' value='1'/></bsdf></scene>",
				      NULL, 0, &e) < 0);
	assert_non_null(strstr(e.text, "`reflectance` is given twice"));
	assert_true(read_with_defines(&s,
				      "<scene version='3.0.0'><bsdf type='diffuse'>"
				      "<rgb name='diffuse_reflectance' value='1'/></bsdf></scene>",
				      NULL, 0, &e) < 0);
	assert_non_null(strstr(e.text, "has no `diffuse_reflectance`"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_every_problem_is_listed_with_its_place),
		cmocka_unit_test(test_rgb_notations_are_read),
		cmocka_unit_test(test_sampled_spectra_are_read),
		cmocka_unit_test(test_points_numbers_and_booleans_are_read),
		cmocka_unit_test(test_transform_steps_apply_in_order),
		cmocka_unit_test(test_names_follow_the_dialect_of_the_file),
		cmocka_unit_test(test_files_of_both_dialects_can_be_combined),
		cmocka_unit_test(test_included_file_may_be_a_single_object),
		cmocka_unit_test(test_capitals_in_type_names_are_ignored),
		cmocka_unit_test(test_parameters_of_forks_are_noted),
		cmocka_unit_test(test_textures_of_shapes_may_have_any_name),
		cmocka_unit_test(test_newer_versions_are_read_as_version_3),
		cmocka_unit_test(test_empty_groups_are_noted_once),
		cmocka_unit_test(test_grey_colours_are_accepted_as_numbers),
		cmocka_unit_test(test_lenient_reading_drops_textures_of_numbers),
		cmocka_unit_test(test_nested_and_referenced_objects_are_found),
		cmocka_unit_test(test_forward_references_and_aliases_are_resolved),
		cmocka_unit_test(test_defines_override_defaults),
		cmocka_unit_test(test_included_objects_and_defaults_are_shared),
		cmocka_unit_test(test_objects_may_contain_includes),
		cmocka_unit_test(test_escaped_dollar_is_literal),
		cmocka_unit_test(test_ignored_elements_are_noted_once),
		cmocka_unit_test(test_depths_beyond_the_limit_are_noted),
		cmocka_unit_test(test_second_name_of_reflectance_is_read_in_0_6),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
