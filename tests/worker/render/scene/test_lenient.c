/* SPDX-License-Identifier: Apache-2.0 */
/* The stand-ins of lenient reading: every unsupported plug-in is replaced by one of its class that exists, and its
 * values by those that the stand-in has. Expected results are written out by hand. */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/render.h"
#include "worker/render/scene/lenient.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/scene/settings.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void test_each_unsupported_plugin_has_its_stand_in(void **state)
{
	(void)state;
	static const struct {
		enum plugin_class cls;
		const char *type;
		enum lenient_action action;
		const char *stand_in;
	} expected[] = {
		{PLUGIN_BSDF, "irawan", LENIENT_INNER, "diffuse"},
		{PLUGIN_BSDF, "neuralbsdf", LENIENT_INNER, "diffuse"},
		{PLUGIN_BSDF, "openpbr", LENIENT_REPLACE, "principled"},
		{PLUGIN_BSDF, "dielectric_disp", LENIENT_REPLACE, "dielectric"},
		{PLUGIN_TEXTURE, "math", LENIENT_INNER, NULL},
		{PLUGIN_TEXTURE, "color_ramp", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_FILM, "tape", LENIENT_REPLACE, "hdrfilm"},
		{PLUGIN_EMITTER, "avg_sunsky", LENIENT_REPLACE, "sunsky"},
		{PLUGIN_EMITTER, "laser", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_RFILTER, "windowed", LENIENT_REPLACE, "gaussian"},
		{PLUGIN_TEXTURE, "curvature", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_SHAPE, "ellipsoids", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_MEDIUM, "homogeneous", LENIENT_LEAVE_OUT, NULL},
		{PLUGIN_SENSOR, "fisheye", LENIENT_REFUSE, NULL},
		{PLUGIN_FILM, "specfilm", LENIENT_REPLACE, "hdrfilm"},
	};
	for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
		const char *stand_in;
		assert_int_equal(lenient_plugin_action(expected[i].cls, expected[i].type, &stand_in),
				 expected[i].action);
		if (!expected[i].stand_in) {
			assert_null(stand_in);
			continue;
		}
		assert_string_equal(stand_in, expected[i].stand_in);
		const struct plugin_decl *d = plugin_find(render_plugins(), expected[i].cls, stand_in);
		assert_non_null(d);
		assert_string_equal(d->type, stand_in);
		/* Or the type needs no stand-in. */
		assert_null(plugin_find(render_plugins(), expected[i].cls, expected[i].type));
	}
}

static void test_parameters_are_renamed_for_the_stand_in(void **state)
{
	(void)state;
	assert_string_equal(lenient_param_name("diffuse", "base_color"), "reflectance");
	assert_string_equal(lenient_param_name("diffuse", "diffuse_reflectance"), "reflectance");
	assert_string_equal(lenient_param_name("diffuse", "alpha"), "alpha");
	assert_string_equal(lenient_param_name("sunsky", "start_month"), "month");
	assert_string_equal(lenient_param_name("sunsky", "turbidity"), "turbidity");
	assert_string_equal(lenient_param_name("roughplastic", "diffuse_reflectance"), "diffuse_reflectance");
}

static struct scene read_leniently(const char *xml)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	if (scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	return s;
}

/* OpenPBR's weights become the parameters of `principled` with the same meaning; others are dropped. */
static void test_openpbr_weights_become_those_of_principled(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='3.0.0'>\n<bsdf type='openpbr' id='b'><rgb name='base_color' value='0.2 0.4 0.6'/>"
		"<float name='base_metalness' value='0.25'/><float name='specular_roughness' value='0.35'/>"
		"<float name='specular_roughness_anisotropy' value='0.45'/><float name='specular_ior' value='1.7'/>"
		"<float name='transmission_weight' value='0.1'/><float name='coat_weight' value='0.15'/>"
		"<float name='coat_roughness' value='0.05'/><float name='fuzz_weight' value='0.65'/>"
		"<float name='thin_film_weight' value='0.5'/></bsdf></scene>";
	static const struct {
		const char *name;
		double value;
	} expected[] = {{"metallic", 0.25},  {"roughness", 0.35}, {"anisotropic", 0.45},    {"eta", 1.7},
			{"spec_trans", 0.1}, {"coat", 0.15},	  {"coat_roughness", 0.05}, {"sheen", 0.65}};
	struct scene s = read_leniently(xml);
	const struct scene_node *b = scene_find_object(&s, "b");
	assert_string_equal(b->type, "principled");
	for (size_t i = 0; i < sizeof expected / sizeof *expected; i++)
		assert_true(node_float(b, expected[i].name, -1) == expected[i].value);
	assert_non_null(node_find_property(b, "base_color"));
	assert_int_equal(b->property_count, 1 + sizeof expected / sizeof *expected);
	assert_true(scene_has_note(&s, "`thin_film_weight` is not supported and left out (lenient)"));
	scene_fini(&s);
}

/* The stand-in follows from the element: the format of a shape's file, the camera in a sensor's name, a material's
 * parameters. */
static void test_stand_in_follows_from_the_element(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='0.6.0'><sensor type='codedOrthographic' id='camera'/>"
		"<sensor type='realisticlens' id='lens'/><sensor type='cmosCamera' id='cmos'/>"
		"<bsdf type='cooktorrance' id='torrance'><rgb name='diffuseReflectance' value='0.2'/>"
		"<rgb name='specularReflectance' value='0.5'/><float name='roughness' value='0.3'/></bsdf>"
		"<shape type='shapenet' id='mesh'><string name='filename' value='a.PLY'/></shape>"
		"<bsdf type='disneybsdf' id='disney'><rgb name='baseColor' value='0.2'/><float name='metallic' value='0.5'/>"
		"<float name='specularTransmission' value='0.25'/></bsdf>"
		"<bsdf type='grating' id='metal'><string name='material' value='Au'/><float name='alpha' value='0.2'/></bsdf>"
		"<bsdf type='microfacet2' id='plastic'><rgb name='diffuseReflectance' value='0.2'/>"
		"<rgb name='specularReflectance' value='0.5'/><float name='alpha' value='0.2'/></bsdf>"
		"<bsdf type='rpv' id='other'><float name='k' value='0.2'/></bsdf>"
		"<bsdf type='smithdielectric' id='frosted'><string name='material' value='none'/>"
		"<float name='alpha' value='0.3'/></bsdf><bsdf type='disneyglass' id='tinted'>"
		"<rgb name='baseColor' value='0.5'/><float name='roughness' value='0.2'/><float name='eta' value='1.4'/>"
		"</bsdf><bsdf type='clearGlass' id='clear'/><bsdf type='thinglass' id='pane'/></scene>";
	static const char *const expected[][2] = {{"camera", "orthographic"},
						  {"mesh", "ply"},
						  {"disney", "principled"},
						  {"metal", "roughconductor"},
						  {"plastic", "roughplastic"},
						  {"other", "diffuse"},
						  {"lens", "perspective"},
						  {"cmos", "perspective"},
						  {"torrance", "roughplastic"},
						  {"frosted", "roughdielectric"},
						  {"tinted", "roughdielectric"},
						  {"clear", "dielectric"},
						  {"pane", "diffuse"}};
	struct scene s = read_leniently(xml);
	for (size_t i = 0; i < sizeof expected / sizeof *expected; i++)
		assert_string_equal(scene_find_object(&s, expected[i][0])->type, expected[i][1]);
	assert_true(node_float(scene_find_object(&s, "disney"), "spec_trans", 0) == 0.25);
	assert_true(node_float(scene_find_object(&s, "torrance"), "alpha", 0) == 0.3);
	assert_true(node_float(scene_find_object(&s, "tinted"), "alpha", 0) == 0.2);
	assert_true(node_float(scene_find_object(&s, "tinted"), "int_ior", 0) == 1.4);
	assert_true(node_find_property(scene_find_object(&s, "tinted"), "specular_transmittance")->value.as.rgb[1] ==
		    0.5);
	scene_fini(&s);
	s = read_leniently(
		"<scene version='3.0.0'><shape type='ellipsoids'><string name='filename' value='a.ply'/></shape>"
		"<bsdf type='diffuse'/></scene>");
	assert_int_equal(s.object_count, 1); /* points are no mesh */
	scene_fini(&s);
}

/* Objects that refer to a subsurface or a field that is left out do without it. */
static void test_references_to_objects_left_out_are_dropped(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='0.6.0'><emitter type='constant'/><subsurface type='dipole' id='d'/>"
				  "<shape type='sphere' id='s'><ref id='d'/><bsdf type='plastic'/></shape></scene>";
	struct scene s = read_leniently(xml);
	assert_string_equal(node_child(scene_find_object(&s, "s"), PLUGIN_BSDF, 0)->type, "plastic");
	assert_int_equal(s.note_count, 1);
	scene_fini(&s);
	s = read_leniently("<scene version='3.0.0'><field type='bitmap' id='f'/><bsdf type='neuralbsdf' id='b'>"
			   "<ref name='reflectance' id='f'/></bsdf></scene>");
	assert_null(node_find_property(scene_find_object(&s, "b"), "reflectance"));
	scene_fini(&s);
}

/* Unsupported textures around others are replaced by the first texture inside; without one they are left out, as
 * fields are. */
static void test_unsupported_textures_are_replaced_by_inner_ones(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='3.0.0'>\n"
		"<bsdf type='diffuse' id='computed'><texture type='math' name='reflectance'>"
		"<string name='expr' value='in[0] * in[1]'/><texture type='checkerboard'/>"
		"<texture type='gridtexture'/></texture></bsdf>\n"
		"<bsdf type='diffuse' id='bare'><texture type='lut' name='reflectance'/></bsdf>\n"
		"<bsdf type='diffuse' id='field'><texture type='fieldtexture' name='reflectance'>"
		"<field name='field' type='bitmap'/></texture></bsdf>\n"
		"<bsdf type='irawan'><texture name='t' type='checkerboard'/><bsdf type='conductor'/></bsdf>"
		"<field type='bitmap'/></scene>";
	struct scene s = read_leniently(xml), strict;
	assert_string_equal(node_ref(scene_find_object(&s, "computed"), "reflectance")->type, "checkerboard");
	assert_null(node_find_property(scene_find_object(&s, "bare"), "reflectance"));
	assert_string_equal(s.objects[3]->type, "conductor"); /* not the texture */
	assert_null(node_find_property(scene_find_object(&s, "field"), "reflectance"));
	assert_true(scene_has_note(&s,
				   "s.xml:2: <texture type=\"math\"> is not supported; the texture inside stands in "
				   "for it (lenient)"));
	assert_true(scene_has_note(&s, "s.xml:3: <texture>: the plug-in `lut` is not supported and left out"));
	scene_fini(&s);
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct error e;
	assert_int_equal(scene_read_all(&strict, &assets, "s.xml", render_plugins(), NULL, 0, false, &e), 0);
	assert_int_equal(strict.problem_count, 5);
	assert_non_null(strstr(strict.problems[0], "this texture of Mitsuba's is not supported; --lenient uses the "
						   "texture inside it instead (supported: "));
	assert_non_null(strstr(strict.problems[4], "fields are not supported; --lenient leaves them out"));
	scene_fini(&strict);
}

/* A portal is not an emitter of the scene, and is ignored even without `lenient`. */
static void test_portals_are_ignored(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'>\n<emitter type='portal'><transform name='to_world'>"
				  "<scale x='2'/></transform></emitter><emitter type='constant'/></scene>";
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_int_equal(s.object_count, 1);
	assert_string_equal(s.objects[0]->type, "constant");
	assert_true(scene_has_note(&s, "s.xml:2: <emitter type=\"portal\"> only guides Mitsuba's sampling and is "
				       "ignored"));
	scene_fini(&s);
}

/* Unsupported coverings of materials are removed, and supported ones are kept: in agreement with bsdf_create() for
 * the same node. */
static void test_unsupported_coverings_are_removed(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		bool is_removed;
	} covers[] = {
		{"coating | diffuse", false},
		{"coating | difftrans", true},
		{"coating | hk", true},
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
		bool removed = lenient_transmissive_inner(node_make_bsdf(&a, covers[i].text)) != NULL,
		     refused = bsdf_try(&a, covers[i].text, true, &b, &e) < 0;
		if (removed != covers[i].is_removed || refused != covers[i].is_removed)
			fail_msg("%s is %ssupported and %s", covers[i].text, refused ? "not " : "",
				 removed ? "goes" : "stays");
		arena_fini(&a);
	}
}

/* A measured material whose file is missing, and one whose file is there. */
static void test_missing_measurements_are_replaced(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='3.0.0'>\n"
		"<bsdf type='measured' id='lost'><string name='filename' value='lost.bsdf'/></bsdf>\n"
		"<bsdf type='Measured' id='there'><string name='filename' value='a.bsdf'/></bsdf></scene>";
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {"a.bsdf", "", 0}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_string_equal(scene_find_object(&s, "lost")->type, "measured");
	scene_fini(&s);
	assert_int_equal(scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_string_equal(scene_find_object(&s, "lost")->type, "roughplastic");
	assert_null(node_find_property(scene_find_object(&s, "lost"), "filename"));
	assert_string_equal(scene_find_object(&s, "there")->type, "measured");
	assert_true(scene_has_note(&s, "s.xml:2: <bsdf type=\"measured\">: lost.bsdf is not among the scene's files; a "
				       "standard roughplastic stands in for it (lenient)"));
	scene_fini(&s);
}

/* Textures with a missing file or an unknown plug-in: an object that is useless without its texture is removed as
 * well. */
static void test_textures_without_files_are_left_out(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='3.0.0'>\n"
		"<texture type='bitmap' id='lost'><string name='filename' value='lost.png'/></texture>\n"
		"<texture type='bitmap' id='there'><string name='filename' value='there.png'/></texture>\n"
		"<bsdf type='diffuse' id='plain'><ref name='reflectance' id='lost'/></bsdf>\n"
		"<bsdf type='diffuse' id='scaled'><texture type='scale' name='reflectance'><ref id='lost'/>"
		"<float name='scale' value='0.5'/></texture></bsdf>\n"
		"<bsdf type='bumpmap' id='bump'><texture type='nowhere'/><bsdf type='conductor'/></bsdf>\n"
		"<bsdf type='normalmap' id='normal'><ref name='normalmap' id='lost'/><ref id='plain'/></bsdf>\n"
		"<bsdf type='mask' id='cut'><ref name='opacity' id='lost'/><ref id='plain'/></bsdf>\n"
		"<bsdf type='mask' id='kept'><ref name='opacity' id='there'/><ref id='plain'/></bsdf>\n"
		"<emitter type='envmap'><string name='filename' value='sky.exr'/></emitter></scene>";
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {"there.png", "", 0}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	/* Strict reading keeps the texture; building it reports the missing file. */
	assert_int_equal(scene_read_all(&s, &assets, "s.xml", render_plugins(), NULL, 0, false, &e), 0);
	assert_int_equal(s.problem_count, 1); /* `nowhere` */
	assert_string_equal(scene_find_object(&s, "lost")->type, "bitmap");
	scene_fini(&s);
	assert_int_equal(scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_null(node_find_property(scene_find_object(&s, "plain"), "reflectance"));
	assert_null(node_find_property(scene_find_object(&s, "scaled"), "reflectance"));
	int conductors = 0, diffuse = 0, masks = 0, textures = 0, emitters = 0;
	for (uint32_t i = 0; i < s.object_count; i++) {
		const char *type = s.objects[i]->type;
		conductors += strcmp(type, "conductor") == 0;
		diffuse += strcmp(type, "diffuse") == 0;
		masks += strcmp(type, "mask") == 0;
		textures += strcmp(type, "bitmap") == 0;
		emitters += strcmp(type, "envmap") == 0;
	}
	/* The conductor of the bump map; `plain` three times, and `scaled`; the mask and the texture whose file
	 * exists. An environment map has no stand-in. */
	assert_int_equal(conductors, 1);
	assert_int_equal(diffuse, 4);
	assert_int_equal(masks, 1);
	assert_int_equal(textures, 1);
	assert_int_equal(emitters, 1);
	assert_int_equal(s.object_count, 8);
	assert_true(scene_has_note(
		&s, "s.xml:2: <texture type=\"bitmap\">: lost.png is not among the scene's files; left out (lenient)"));
	assert_true(scene_has_note(
		&s, "s.xml:6: <texture>: the plug-in `nowhere` is not supported and left out (lenient)"));
	assert_true(scene_has_note(
		&s,
		"s.xml:6: <bsdf type=\"bumpmap\"> has no texture left; the BSDF inside stands in for it (lenient)"));
	scene_fini(&s);
}

/* An unsupported light in a shape becomes an area light with the same radiance; elsewhere it is left out. */
static void test_unsupported_lights_of_shapes_become_area_lights(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'>\n<emitter type='photon'/>\n<shape type='rectangle'>\n"
				  "<emitter type='angulararea'><rgb name='radiance' value='3'/>"
				  "<float name='cutoff_angle' value='35'/></emitter></shape></scene>";
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_true(scene_read_all(&s, &assets, "s.xml", render_plugins(), NULL, 0, false, &e) == 0);
	assert_int_equal(s.problem_count, 2);
	assert_non_null(strstr(s.problems[0], "there is no emitter of this type; --lenient leaves it out"));
	assert_non_null(strstr(s.problems[1], "there is no emitter of this type; --lenient uses `area` instead"));
	scene_fini(&s);
	assert_int_equal(scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_int_equal(s.object_count, 1);
	const struct scene_node *light = node_child(s.objects[0], PLUGIN_EMITTER, 0);
	assert_non_null(light);
	assert_string_equal(light->type, "area");
	assert_int_equal(light->property_count, 1);
	assert_true(node_find_property(light, "radiance")->value.as.rgb[0] == 3);
	assert_true(scene_has_note(
		&s,
		"s.xml:4: <emitter type=\"angulararea\"> is not supported; the plug-in area stands in for it (lenient)"));
	scene_fini(&s);
}

/* A volume whose value has a wrong name has no value: the volume is left out, and the medium that needs it. In 3.x
 * the value has a default. */
static void test_volumes_without_a_value_are_left_out(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='0.6.0'>\n<medium type='heterogeneous' id='smoke'>\n"
		"<volume name='density' type='constvolume'><float name='value' value='3'/></volume>\n"
		"<volume name='albedo' type='constvolume'><spectrum name='color' value='0.9'/></volume>\n</medium>\n"
		"<shape type='sphere'><ref name='interior' id='smoke'/></shape></scene>";
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0); /* building it fails */
	scene_fini(&s);
	assert_int_equal(scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_int_equal(s.object_count, 2); /* the sphere and the default sky */
	assert_null(node_ref(s.objects[0], "interior"));
	assert_true(scene_has_note(&s, "s.xml:4: <volume type=\"constvolume\"> has no `value`: left out (lenient)"));
	assert_true(scene_has_note(
		&s, "s.xml:2: <medium type=\"heterogeneous\"> is left out, because a part of it is missing"));
	scene_fini(&s);
	static const char new[] = "<scene version='3.0.0'><volume type='constvolume'/></scene>";
	const struct memory_file new_files[] = {{"s.xml", new, sizeof new - 1}, {0}};
	const struct asset_source of_new = memory_assets(new_files);
	assert_int_equal(scene_read_lenient(&s, &of_new, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_int_equal(s.object_count, 1);
	scene_fini(&s);
}

/* Names of 0.6 in a file of 3.x are read in lenient mode, in any object, and refused in strict mode. A value of an
 * unsupported plug-in may have another meaning, so one that is invalid for the stand-in is dropped. */
static void test_names_of_the_other_dialect_are_read(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='2.0.0'>\n<sensor type='perspective'>\n"
		"<transform name='toWorld'><translate x='3'/></transform></sensor>\n"
		"<bsdf type='microfacet' id='old'>\n<rgb name='diffuseReflectance' value='0.25'/></bsdf>\n"
		"<bsdf type='measuredbtf' id='other'>\n<float name='reflectance' value='450'/></bsdf>\n"
		"<bsdf type='diffuse' id='both'><rgb name='diffuseReflectance' value='0.1'/>\n"
		"<rgb name='reflectance' value='0.75'/><rgb name='diffuseReflectance' value='0.2'/></bsdf>\n"
		"<shape type='sphere' id='twice'><transform name='toWorld'><translate x='3'/></transform>\n"
		"<transform name='toWorld'><translate x='4'/></transform></shape>\n"
		"<bsdf type='measuredbtf' id='third'><string name='reflectance' value='a'/></bsdf></scene>";
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), -EINVAL);
	assert_non_null(strstr(e.text, "has no `toWorld`; did you mean `to_world`?"));
	if (scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	const struct property *p = node_find_property(scene_sensor(&s, 1), "to_world");
	assert_true(p && p->value.as.transform.m[0][3] == 3);
	p = node_find_property(scene_find_object(&s, "old"), "reflectance");
	assert_true(p && p->value.as.rgb[0] == 0.25);
	assert_null(node_find_property(scene_find_object(&s, "other"), "reflectance"));
	assert_null(node_find_property(scene_find_object(&s, "third"), "reflectance"));
	p = node_find_property(scene_find_object(&s, "both"), "reflectance");
	assert_true(p && p->value.as.rgb[0] == 0.75);
	assert_true(node_transform(scene_find_object(&s, "twice"), "to_world").m[0][3] == 3);
	assert_true(scene_has_note(&s, "s.xml:11: <transform>: the parameter `toWorld` is not supported and left out"));
	assert_true(scene_has_note(
		&s, "s.xml:3: <sensor type=\"perspective\">: `toWorld` is read as `to_world` (lenient)"));
	assert_true(scene_has_note(&s, "s.xml:7: <float>: the value `450` is not supported and left out (lenient)"));
	scene_fini(&s);
}

/* The picture of a fork's projector, unless it has one under Mitsuba's name. */
static void test_picture_of_projector(void **state)
{
	(void)state;
#define PICTURE(name) "<texture type='checkerboard' name='" name "'/>"
	static const char xml[] = "<scene version='0.6.0'><emitter type='projector' id='fork'>" PICTURE(
		"texture") "</emitter>\n<emitter type='projector' id='both'>"
			   "<rgb name='irradiance' value='3'/>" PICTURE(
				   "texture") "</emitter>\n"
					      "<emitter type='directional' id='other'>" PICTURE(
						      "texture") "</emitter></scene>";
	static const char named[] = "<scene version='0.6.0'><emitter type='projector'>"
				    "<string name='texture' value='a.png'/></emitter></scene>";
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {NULL, NULL, 0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), -EINVAL);
	assert_non_null(strstr(e.text, "has no `texture`"));
	if (scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	const struct scene_node *picture = node_ref(scene_find_object(&s, "fork"), "irradiance");
	assert_true(picture && strcmp(picture->type, "checkerboard") == 0);
	assert_null(node_ref(scene_find_object(&s, "both"), "irradiance"));
	assert_false(scene_has_note(&s, "<emitter type=\"directional\">: `texture` is read as"));
	assert_true(scene_has_note(
		&s, "s.xml:1: <emitter type=\"projector\">: `texture` is read as `irradiance` (lenient)"));
	assert_true(scene_has_note(&s, "s.xml:2: <texture>: the parameter `texture` is not supported and left out"));
	scene_fini(&s);
	const struct memory_file named_files[] = {{"s.xml", named, strlen(named)}, {NULL, NULL, 0}};
	assets = memory_assets(named_files);
	if (scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	assert_true(scene_has_note(&s, "`texture` is not known and is ignored"));
	scene_fini(&s);
}

/* A parameter or object given twice to an unsupported plug-in is no mistake; of several layers, the stand-in is not
 * the glass. */
static void test_surplus_parameters_and_objects_are_dropped(void **state)
{
	(void)state;
	static const char xml[] =
		"<scene version='2.2.1'>\n<sensor type='perspective'><film type='streakfilm' id='film'>"
		"<rfilter name='rfilter' type='gaussian'/>\n<rfilter name='tfilter' type='box'/></film></sensor>"
		"<bsdf type='disneybsdf' id='disney'><rgb name='baseColor' value='0.2'/><float name='metallic' value='0.5'/>"
		"\n<float name='specular' value='0.5'/><float name='eta' value='1.7'/></bsdf>"
		"<bsdf type='multilayered'><bsdf type='roughdielectric' name='surface_0'/>"
		"<bsdf type='roughconductor' name='surface_1' id='metal'/><bsdf type='diffuse' name='surface_2'/></bsdf>"
		"<bsdf type='multilayered'><bsdf type='dielectric' id='glass'/><bsdf type='roughdielectric'/></bsdf></scene>";
	struct scene s = read_leniently(xml);
	const struct scene_node *film = node_child(s.objects[0], PLUGIN_FILM, 0),
				*disney = scene_find_object(&s, "disney");
	assert_string_equal(film->type, "hdrfilm");
	assert_int_equal(film->child_count, 1);
	assert_string_equal(film->children[0]->type, "gaussian");
	assert_null(node_find_property(disney, "specular"));
	assert_true(node_float(disney, "eta", 0) == 1.7);
	assert_string_equal(scene_find_object(&s, "metal")->type, "roughconductor");
	assert_string_equal(scene_find_object(&s, "glass")->type, "dielectric");
	assert_true(scene_has_note(&s, "s.xml:3: <rfilter>: a second object, `tfilter` is not supported and left out"));
	assert_true(scene_has_note(
		&s, "s.xml:4: <bsdf type=\"disneybsdf\">: `specular` is left out, because the index of"));
	scene_fini(&s);
	static const char twice[] = "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'>"
				    "<rfilter type='box'/><rfilter type='tent'/></film></sensor></scene>";
	const struct memory_file files[] = {{"s.xml", twice, sizeof twice - 1}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct error e;
	assert_int_not_equal(scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), 0);
	assert_non_null(strstr(e.text, "a second rfilter in"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_each_unsupported_plugin_has_its_stand_in),
		cmocka_unit_test(test_openpbr_weights_become_those_of_principled),
		cmocka_unit_test(test_stand_in_follows_from_the_element),
		cmocka_unit_test(test_references_to_objects_left_out_are_dropped),
		cmocka_unit_test(test_unsupported_textures_are_replaced_by_inner_ones),
		cmocka_unit_test(test_portals_are_ignored),
		cmocka_unit_test(test_parameters_are_renamed_for_the_stand_in),
		cmocka_unit_test(test_unsupported_coverings_are_removed),
		cmocka_unit_test(test_missing_measurements_are_replaced),
		cmocka_unit_test(test_textures_without_files_are_left_out),
		cmocka_unit_test(test_unsupported_lights_of_shapes_become_area_lights),
		cmocka_unit_test(test_volumes_without_a_value_are_left_out),
		cmocka_unit_test(test_names_of_the_other_dialect_are_read),
		cmocka_unit_test(test_picture_of_projector),
		cmocka_unit_test(test_surplus_parameters_and_objects_are_dropped),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
