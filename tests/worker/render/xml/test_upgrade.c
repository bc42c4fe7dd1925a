/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of Mitsuba versions before 0.5, against twins rewritten for 0.5 by hand by the rules of its upgrade: the same
 * objects with the same values. Also against themselves: before 0.4, cameras were mirrored.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "worker/render/render.h"
#include "worker/render/scene/scene.h"
#include "worker/render/scene/value.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static struct memory_file files[4];

static int read_version(struct scene *s, const char *version, const char *body, const char *included, struct error *e)
{
	static char text[8192];
	snprintf(text, sizeof text, "<scene version='%s'>%s</scene>", version, body);
	files[0] = (struct memory_file){"s.xml", text, strlen(text)};
	files[1] = (struct memory_file){"i.xml", included, strlen(included)};
	struct asset_source assets = memory_assets(files);
	return scene_read(s, &assets, "s.xml", render_plugins(), NULL, 0, e);
}

static struct scene read_valid(const char *version, const char *body, const char *included)
{
	struct scene s;
	struct error e;
	if (read_version(&s, version, body, included, &e))
		fail_msg("%s: %s", version, e.text);
	return s;
}

static void assert_same_node(const struct scene_node *a, const struct scene_node *b);

static void assert_same_property(const struct scene_node *of, const struct property *p, const struct property *q)
{
	double x[3], y[3];
	uint32_t n, m;
	if (!q || p->value.type != q->value.type)
		fail_msg("%s: %s differs", of->type, p->name);
	const double *u = value_numbers(&p->value, x, &n), *v = value_numbers(&q->value, y, &m);
	assert_int_equal(n, m);
	for (uint32_t i = 0; i < n; i++)
		assert_true(u[i] == v[i]);
	if (p->value.type == VALUE_STRING)
		assert_string_equal(p->value.as.string, q->value.as.string);
	if (p->value.type == VALUE_BOOL)
		assert_int_equal(p->value.as.boolean, q->value.as.boolean);
	if (p->value.type == VALUE_TRANSFORM)
		for (int i = 0; i < 16; i++)
			assert_true(p->value.as.transform.m[i / 4][i % 4] == q->value.as.transform.m[i / 4][i % 4]);
	if (p->value.type == VALUE_NODE)
		assert_same_node(p->value.as.node, q->value.as.node);
}

static void assert_same_node(const struct scene_node *a, const struct scene_node *b)
{
	assert_int_equal(a->cls, b->cls);
	assert_string_equal(a->type, b->type);
	if (a->property_count != b->property_count || a->child_count != b->child_count)
		fail_msg("%s: %u values and %u objects, not %u and %u", a->type, a->property_count, a->child_count,
			 b->property_count, b->child_count);
	for (uint32_t i = 0; i < a->property_count; i++)
		assert_same_property(a, &a->properties[i], node_find_property(b, a->properties[i].name));
	for (uint32_t i = 0; i < a->child_count; i++)
		assert_same_node(a->children[i], b->children[i]);
}

static void assert_twins(const char *version, const char *body, const char *included, const char *now,
			 const char *other)
{
	struct scene a = read_valid(version, body, included), b = read_valid("0.6.0", now, other);
	assert_int_equal(a.object_count, b.object_count);
	for (uint32_t i = 0; i < a.object_count; i++)
		assert_same_node(a.objects[i], b.objects[i]);
	scene_fini(&a);
	scene_fini(&b);
}

#define LOOK "<lookAt origin='1,2,3' target='0,0,0' up='0,1,0'/>"
#define PART "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='4'/></film>"
#define TO(x) "<transform name='toWorld'>" x "</transform>"

static void test_version_0_3_reads_like_its_twin(void **state)
{
	(void)state;
	assert_twins(
		"0.3.0",
		"<camera type='thinlens'><float name='focusDepth' value='3'/><float name='apertureRadius' value='.1'/>" TO(
			LOOK) "<film type='exrfilm'><integer name='width' value='8'/><boolean name='alpha' value='false'/>"
			      "</film></camera>"
			      "<luminaire type='envmap'><string name='filename' value='sky.exr'/>"
			      "<float name='intensityScale' value='2'/></luminaire>"
			      "<luminaire type='directional'><vector name='direction' x='0' y='0' z='1'/>"
			      "<spectrum name='intensity' value='4'/></luminaire>"
			      "<luminaire type='point'><spectrum name='intensity' value='5'/></luminaire>"
			      "<shape type='sphere'><luminaire type='area'><blackbody name='intensity' "
			      "temperature='5000' multiplier='3'/></luminaire><bsdf type='bump'>"
			      "<texture type='bitmap'><string name='filename' value='a.png'/></texture>"
			      "<bsdf type='diffuse'/></bsdf></shape>",
		"",
		"<sensor type='thinlens'><float name='focusDistance' value='3'/><float name='apertureRadius' value='.1'/>" TO(
			"<scale x='-1'/>" LOOK) "<film type='hdrfilm'><integer name='width' value='8'/></film></sensor>"
						"<emitter type='envmap'><string name='filename' value='sky.exr'/>"
						"<float name='scale' value='2'/></emitter>"
						"<emitter type='directional'><vector name='direction' x='0' y='0' z='1'/>"
						"<spectrum name='irradiance' value='4'/></emitter>"
						"<emitter type='point'><spectrum name='intensity' value='5'/></emitter>"
						"<shape type='sphere'><emitter type='area'><blackbody name='radiance' "
						"temperature='5000' scale='3'/></emitter><bsdf type='bumpmap'>"
						"<texture type='bitmap'><string name='filename' value='a.png'/></texture>"
						"<bsdf type='diffuse'/></bsdf></shape>",
		"");
}

static void test_version_0_2_reads_like_its_twin(void **state)
{
	(void)state;
	assert_twins("0.2.1",
		     "<shape type='sphere'><boolean name='inverted' value='true'/><bsdf type='lambertian'>"
		     "<texture name='reflectance' type='checkerboard'><spectrum name='brightColor' value='.8'/>"
		     "<spectrum name='darkColor' value='.3'/></texture></bsdf></shape>"
		     "<shape type='cylinder'><point name='p1' x='0' y='0' z='1'/><point name='p2' x='0' y='0' z='4'/>"
		     "<bsdf type='roughglass'><float name='alphaB' value='.3'/></bsdf></shape>"
		     "<bsdf type='composite'><string name='weights' value='.3 .4'/><bsdf type='roughmetal'>"
		     "<float name='alphaB' value='.2'/></bsdf><bsdf type='diffuse'><texture name='reflectance' "
		     "type='ldrtexture'><string name='filename' value='a.png'/></texture></bsdf></bsdf>",
		     "",
		     "<shape type='sphere'><boolean name='flipNormals' value='true'/><bsdf type='diffuse'>"
		     "<texture name='reflectance' type='checkerboard'><spectrum name='color0' value='.8'/>"
		     "<spectrum name='color1' value='.3'/></texture></bsdf></shape>"
		     "<shape type='cylinder'><point name='p0' x='0' y='0' z='1'/><point name='p1' x='0' y='0' z='4'/>"
		     "<bsdf type='roughdielectric'><float name='alpha' value='.3'/></bsdf></shape>"
		     "<bsdf type='mixturebsdf'><string name='weights' value='.3 .4'/><bsdf type='roughconductor'>"
		     "<float name='alpha' value='.2'/></bsdf><bsdf type='diffuse'><texture name='reflectance' "
		     "type='bitmap'><string name='filename' value='a.png'/></texture></bsdf></bsdf>",
		     "");
}

/* Colours with a factor other than 1 move into a texture `scale`, and missing colours had other default values. */
static void test_materials_of_version_0_2_are_upgraded(void **state)
{
	(void)state;
	assert_twins(
		"0.2.0",
		"<bsdf type='phong'><float name='diffuseAmount' value='.5'/><float name='exponent' value='9'/>"
		"<rgb name='diffuseReflectance' value='.8 .4 .2'/></bsdf>"
		"<bsdf type='microfacet'/><bsdf type='ward'><float name='diffuseAmount' value='.4'/>"
		"<rgb name='diffuseReflectance' value='.8 .4 .2'/>"
		"<texture name='specularReflectance' type='checkerboard'/><float name='alphaY' value='.3'/></bsdf>"
		"<bsdf type='ward'><float name='specularAmount' value='1.0'/><float name='alphaX' value='.1'/>"
		"<float name='alphaY' value='.3'/><texture name='specularReflectance' type='checkerboard'/></bsdf>"
		"<bsdf type='microfacet'><float name='alphaB' value='.2'/><float name='specularAmount' value='.3'/>"
		"<texture name='specularReflectance' type='checkerboard'><float name='uscale' value='2'/></texture>"
		"</bsdf>"
		"<shape type='sphere'><bsdf type='mirror'><spectrum name='specularReflectance' value='.9'/></bsdf>"
		"</shape><bsdf type='roughmetal'><float name='ior' value='2'/></bsdf>"
		"<bsdf type='diffuse'><texture name='reflectance' type='gridtexture'>"
		"<spectrum name='brightColor' value='.8'/><spectrum name='darkColor' value='.3'/></texture></bsdf>",
		"",
		"<bsdf type='phong'><texture name='diffuseReflectance' type='scale'><float name='scale' value='.5'/>"
		"<rgb name='value' value='.8 .4 .2'/></texture><spectrum name='specularReflectance' value='.2'/>"
		"<float name='exponent' value='9'/></bsdf>"
		"<bsdf type='roughplastic'><spectrum name='diffuseReflectance' value='0'/>"
		"<spectrum name='specularReflectance' value='1'/></bsdf>"
		"<bsdf type='ward'><texture name='diffuseReflectance' type='scale'><float name='scale' value='.4'/>"
		"<rgb name='value' value='.8 .4 .2'/></texture>"
		"<texture name='specularReflectance' type='checkerboard'/><float name='alphaV' value='.3'/></bsdf>"
		"<bsdf type='ward'><spectrum name='diffuseReflectance' value='.5'/><float name='alphaU' value='.1'/>"
		"<float name='alphaV' value='.3'/><texture name='specularReflectance' type='checkerboard'/></bsdf>"
		"<bsdf type='roughplastic'><float name='alpha' value='.2'/>"
		"<spectrum name='diffuseReflectance' value='0'/>"
		"<texture name='specularReflectance' type='scale'><float name='scale' value='.3'/>"
		"<texture name='value' type='checkerboard'><float name='uscale' value='2'/></texture></texture></bsdf>"
		"<shape type='sphere'><bsdf type='conductor'><spectrum name='specularReflectance' value='.9'/>"
		"<string name='material' value='Cr'/></bsdf></shape>"
		"<bsdf type='roughconductor'><float name='eta' value='2'/></bsdf>"
		"<bsdf type='diffuse'><texture name='reflectance' type='gridtexture'>"
		"<spectrum name='color0' value='.8'/><spectrum name='color1' value='.3'/></texture></bsdf>",
		"");
}

/* The first lookAt was mirrored, and so were cameras: both together give today's result. */
static void test_mirrored_lookat_of_first_versions_is_undone(void **state)
{
	(void)state;
	static const char first[] = "<lookAt ox='1' oy='2' oz='3' tx='0' ty='0' tz='0' ux='0' uy='1' uz='0'/>";
	char old[1024];
	snprintf(old, sizeof old,
		 "<camera type='orthographic'>" TO("%s<translate x='5'/>") PART
		 "</camera>"
		 "<luminaire type='spot'>" TO("%s") "</luminaire>",
		 first, first);
	assert_twins("0.2.0", old, "",
		     "<sensor type='orthographic'>" TO(LOOK "<translate x='5'/>") PART
		     "</sensor><emitter type='spot'>" TO("<scale x='-1'/>" LOOK) "</emitter>",
		     "");
	assert_twins(
		"0.2.0",
		"<luminaire type='spot'>" TO("<lookAt ox='1' oy='2' oz='3' tx='0' ty='0' tz='0'/>") "</luminaire>", "",
		"<emitter type='spot'>" TO("<scale x='-1'/><lookAt origin='1 2 3' target='0 0 0'/>") "</emitter>", "");
}

/* A file that includes one of another version keeps its own; the field of view refers to the smaller side. */
static void test_each_file_keeps_its_own_version(void **state)
{
	(void)state;
	static const char *const axes[][2] = {{"", "smaller"},
					      {"<boolean name='mapSmallerSide' value='true'/>", "smaller"},
					      {"<boolean name='mapSmallerSide' value='false'/>", "larger"}};
	for (size_t i = 0; i < 3; i++) {
		char old[1024], now[1024];
		snprintf(old, sizeof old,
			 "<scene version='0.3'><camera type='perspective'>%s" TO(LOOK) PART "</camera></scene>",
			 axes[i][0]);
		snprintf(now, sizeof now,
			 "<scene version='0.5.0'><sensor type='perspective'><string name='fovAxis' value='%s'/>" TO(
				 "<scale x='-1'/>" LOOK) PART "</sensor></scene>",
			 axes[i][1]);
		assert_twins("0.5.0", "<include filename='i.xml'/><emitter type='constant'/>", old,
			     "<include filename='i.xml'/><emitter type='constant'/>", now);
	}
}

/* Parameters that the upgrade moves to another element have an effect: no note calls them ignored. */
static void test_moved_parameters_are_not_noted_as_ignored(void **state)
{
	(void)state;
	struct scene s = read_valid("0.2.0",
				    "<camera type='perspective'><boolean name='mapSmallerSide' value='true'/>" TO(
					    LOOK) "<boolean name='mapSmallerSide' value='false'/></camera>"
						  "<bsdf type='phong'><float name='specularAmount' value='.5'/></bsdf>",
				    "");
	assert_false(scene_has_note(&s, "is ignored"));
	assert_string_equal(node_string(s.objects[0], "fov_axis", ""), "larger");
	scene_fini(&s);
}

/* `disney`, the name of `principled` and `principledthin` before their release, is read in files of 2.x and 3.x only.
 */
static void test_disney_is_read_as_principled(void **state)
{
	(void)state;
	static const struct {
		const char *inside, *type;
	} cases[] = {
		{"<float name='metallic' value='1'/>", "principled"},
		{"<boolean name='thin' value='false'/><float name='clearcoat' value='1'/>", "principled"},
		{"<float name='diff_trans' value='1'/><boolean name='thin' value='True'/>", "principledthin"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char body[256];
		snprintf(body, sizeof body, "<bsdf type='twosided'><bsdf type='Disney'>%s</bsdf></bsdf>",
			 cases[i].inside);
		struct scene s = read_valid("2.0.0", body, "");
		const struct scene_node *n = node_child(s.objects[0], PLUGIN_BSDF, 0);
		assert_string_equal(n->type, cases[i].type);
		assert_int_equal(n->property_count, 1);
		assert_int_equal(s.note_count, 0);
		scene_fini(&s);
	}
	struct scene s;
	struct error e;
	assert_true(read_version(&s, "0.6.0", "<bsdf type='disney'/>", "", &e));
	assert_non_null(strstr(e.text, "there is no bsdf of this type"));
	assert_true(read_version(&s, "3.0.0", "<bsdf type='disney'><boolean name='thin' value='x'/></bsdf>", "", &e));
	assert_non_null(strstr(e.text, "`thin` of <bsdf type=\"principled\"> would change the image"));
}

/* The same text as version 0.3, and as 0.4, which does not mirror cameras. */
static void test_version_0_3_mirrors_cameras(void **state)
{
	(void)state;
	const char *text = "<camera type='perspective'>" TO(LOOK) PART "</camera>";
	struct scene a = read_valid("0.3.0", text, ""), b = read_valid("0.4.0", text, "");
	const mat4 m = node_transform(a.objects[0], "to_world"), n = node_transform(b.objects[0], "to_world");
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 4; k++)
			assert_true(m.m[i][k] == (k == 0 ? -n.m[i][k] : n.m[i][k]));
	assert_int_equal(a.note_count, b.note_count + 1);
	assert_true(scene_has_note(&a, "mirrors the cameras") && !scene_has_note(&b, "mirrors the cameras"));
	scene_fini(&a);
	scene_fini(&b);
}

static void test_invalid_old_files_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *version, *body, *sentence;
	} cases[] = {
		{"0.2.0", "<bsdf type='phong'><float name='diffuseAmount' value='x'/></bsdf>",
		 "`x` is not a (finite) number"},
		{"0.2.0", "<camera type='perspective'>" TO("<lookAt ox='1' tx='2'/>") "</camera>",
		 "is not three numbers"},
		{"0.2.0", "<camera type='perspective'>" TO("<lookAt ox='1'><x/></lookAt>") "</camera>",
		 "has no place in <lookAt>"},
		{"0.3.0", "<bsdf type='mirror'/>", "there is no bsdf of this type"},
		{"0.3.0", "<bsdf type='lambertian'/>", "there is no bsdf of this type"},
		{"0.4.0", "<luminaire type='constant'/>", "there is no element of this name; did you mean `emitter`?"},
		{"0.5.0", "<bsdf type='bump'/>", "there is no bsdf of this type"},
		{"0.-3", "<emitter type='constant'/>", ""},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct scene s;
		struct error e = {""};
		int r = read_version(&s, cases[i].version, cases[i].body, "", &e);
		if (!*cases[i].sentence) {
			if (!r)
				scene_fini(&s);
			continue;
		}
		if (!r || !strstr(e.text, cases[i].sentence))
			fail_msg("%s %s: \"%s\"", cases[i].version, cases[i].body, r ? e.text : "no error");
	}
}

/* Before 0.3, files had no version. Files included by a file without a version need none either. */
static void test_files_without_version_are_the_oldest(void **state)
{
	(void)state;
	static const char marked[] = "<scene version='0.2.0'>", plain[] = "<scene>",
			  body[] = "<include filename='i.xml'/><camera type='perspective'><transform name='toWorld'>"
				   "<translate x='1'/></transform></camera><luminaire type='constant'>"
				   "<spectrum name='intensity' value='2'/></luminaire></scene>",
			  inner[] = "<scene%s><bsdf type='lambertian' id='a'/></scene>";
	char text[2][1024], included[2][128];
	struct scene s[2];
	for (int i = 0; i < 2; i++) {
		snprintf(text[i], sizeof text[i], "%s%s", i ? plain : marked, body);
		snprintf(included[i], sizeof included[i], inner, i ? "" : " version='0.2.0'");
		files[0] = (struct memory_file){"s.xml", text[i], strlen(text[i])};
		files[1] = (struct memory_file){"i.xml", included[i], strlen(included[i])};
		struct asset_source assets = memory_assets(files);
		struct error e;
		if (scene_read(&s[i], &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s", e.text);
		assert_true(scene_has_note(&s[i], "s.xml: is of a version before 0.4: read as by Mitsuba 0.5"));
	}
	assert_int_equal(s[1].object_count, 3);
	for (uint32_t k = 0; k < 3; k++)
		assert_same_node(s[0].objects[k], s[1].objects[k]);
	scene_fini(&s[0]);
	scene_fini(&s[1]);
	static const char *const refused[] = {
		"<scene><sensor type='perspective'/><emitter type='constant'/></scene>",
		"<scene><shape type='sphere'/></scene>",
		"<scene version='0.2.0'><include filename='i.xml'/><camera type='perspective'/></scene>",
	};
	for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
		files[0] = (struct memory_file){"s.xml", refused[i], strlen(refused[i])};
		struct asset_source assets = memory_assets(files);
		struct error e;
		if (!scene_read(&s[0], &assets, "s.xml", render_plugins(), NULL, 0, &e) ||
		    !strstr(e.text, "needs a version, such as version="))
			fail_msg("%s: \"%s\"", refused[i], e.text);
	}
}

/* From 2.x on an object may have a version: the names in this object and the objects inside it follow it, and no
 * others do. */
static void test_objects_may_have_their_own_version(void **state)
{
	(void)state;
	static const char old[] =
		"<shape type='sphere' version='0.6.0'><transform name='toWorld'><translate x='3'/>"
		"</transform><bsdf type='plastic'><float name='intIOR' value='1.4'/></bsdf></shape>"
		"<shape type='disk' version='3.5'><transform name='to_world'><translate y='2'/></transform>"
		"<bsdf type='plastic' version='2.0.0'><float name='int_ior' value='1.3'/></bsdf></shape>",
			  now[] = "<shape type='sphere'><transform name='to_world'><translate x='3'/></transform>"
				  "<bsdf type='plastic'><float name='int_ior' value='1.4'/></bsdf></shape>"
				  "<shape type='disk'><transform name='to_world'><translate y='2'/></transform>"
				  "<bsdf type='plastic'><float name='int_ior' value='1.3'/></bsdf></shape>";
	struct scene s[2] = {read_valid("2.0.0", old, ""), read_valid("3.0.0", now, "")};
	assert_int_equal(s[0].object_count, 2);
	for (uint32_t i = 0; i < 2; i++)
		assert_same_node(s[0].objects[i], s[1].objects[i]);
	scene_fini(&s[0]);
	scene_fini(&s[1]);
	static const char *const refused[][3] = {
		{"3.0.0",
		 "<shape type='sphere' version='0.6.0'/><shape type='sphere'><transform name='toWorld'/></shape>",
		 "has no `toWorld`"},
		{"3.0.0", "<shape type='sphere' version='new'/>", "version=\"new\" is not one of Mitsuba's"},
		{"3.0.0", "<shape type='sphere'><float name='radius' value='1' version='3.0.0'/></shape>",
		 "has no attribute `version`"},
		{"0.6.0", "<shape type='sphere' version='0.6.0'/>", "has no attribute `version`"},
	};
	for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
		struct error e;
		if (!read_version(&s[0], refused[i][0], refused[i][1], "", &e) || !strstr(e.text, refused[i][2]))
			fail_msg("%s: \"%s\"", refused[i][1], e.text);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_version_0_3_reads_like_its_twin),
		cmocka_unit_test(test_version_0_2_reads_like_its_twin),
		cmocka_unit_test(test_materials_of_version_0_2_are_upgraded),
		cmocka_unit_test(test_mirrored_lookat_of_first_versions_is_undone),
		cmocka_unit_test(test_each_file_keeps_its_own_version),
		cmocka_unit_test(test_moved_parameters_are_not_noted_as_ignored),
		cmocka_unit_test(test_disney_is_read_as_principled),
		cmocka_unit_test(test_version_0_3_mirrors_cameras),
		cmocka_unit_test(test_invalid_old_files_are_refused),
		cmocka_unit_test(test_files_without_version_are_the_oldest),
		cmocka_unit_test(test_objects_may_have_their_own_version),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
