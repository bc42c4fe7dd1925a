/* SPDX-License-Identifier: Apache-2.0 */
/* OBJ shapes of 0.6 whose file names materials: the BSDF of each material's faces, from the scene or from the .mtl
 * file. */
#include "tests/support/failing_memory.h"
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"
#include "worker/render/scene/mtl.h"
#include "worker/render/scene/obj_materials.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define FACES "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define FACE "f 1 2 3\n"
static const char model[] = "mtllib m\\lib.mtl \n" FACES "usemtl gold leaf\n" FACE "usemtl nothing\nusemtl glass\n" FACE
			    "usemtl gold leaf\r\n" FACE;

static const char *material_library = "newmtl gold leaf\nKd 1 0.5 0\n";

static int read_scene(struct scene *s, const char *version, const char *xml, struct error *e)
{
	char text[4096];
	snprintf(text, sizeof text, "<scene version='%s'>%s</scene>", version, xml);
	const struct memory_file files[] = {{"s.xml", text, strlen(text)},
					    {"d/m.obj", model, sizeof model - 1},
					    {"d/m/lib.mtl", material_library, strlen(material_library)},
					    {"d/m/wood.png", "", 0},
					    {0}};
	struct asset_source assets = memory_assets(files);
	return scene_read_all(s, &assets, "s.xml", render_plugins(), NULL, 0, false, e);
}

static struct scene read_valid(const char *xml)
{
	struct scene s;
	struct error e;
	if (read_scene(&s, "0.6.0", xml, &e))
		fail_msg("%s", e.text);
	if (s.problem_count)
		fail_msg("%s", s.problems[0]);
	return s;
}

#define OBJ(x) "<shape type='obj'><string name='filename' value='d/m.obj'/>" x "</shape>"
#define BSDF(name, value) "<bsdf type='diffuse' " name "><float name='reflectance' value='" value "'/></bsdf>"

static const struct scene_node *find_last_shape(const struct scene *s)
{
	uint32_t i = s->object_count;
	while (i > 0 && s->objects[i - 1]->cls != PLUGIN_SHAPE)
		i--;
	assert_true(i > 0);
	return s->objects[i - 1];
}

/* Returns one part of the scene's only shape, a merge of the two materials that have faces. */
static const struct scene_node *material_part(const struct scene *s, uint32_t index)
{
	static const char *const names[] = {"gold leaf", "glass"};
	const struct scene_node *merge = find_last_shape(s);
	assert_string_equal(merge->type, "merge");
	assert_int_equal(merge->child_count, 2);
	const struct scene_node *part = merge->children[index];
	assert_string_equal(part->type, "obj");
	assert_string_equal(node_string(part, "filename", ""), "d/m.obj");
	assert_string_equal(node_string(part, "material", ""), names[index]);
	return part;
}

/* Returns the reflectance of a part's BSDF, or -1 if the part has none. */
static double part_reflectance(const struct scene *s, uint32_t index)
{
	const struct scene_node *bsdf = node_child(material_part(s, index), PLUGIN_BSDF, 0);
	return bsdf ? node_float(bsdf, "reflectance", -2) : -1;
}

static void check_reflectances(const char *content, double gold, double glass, const char *note)
{
	char lit[3072];
	snprintf(lit, sizeof lit, "<emitter type='constant'/>%s", content);
	struct scene s = read_valid(lit);
	double found[] = {part_reflectance(&s, 0), part_reflectance(&s, 1)};
	if (found[0] != gold || found[1] != glass)
		fail_msg("%s\n gave %g and %g", content, found[0], found[1]);
	assert_int_equal(s.note_count, note != NULL);
	if (note && !strstr(s.notes[0], note))
		fail_msg("%s\n not: %s", s.notes[0], note);
	scene_fini(&s);
}

static void test_named_bsdfs_apply_to_their_materials(void **state)
{
	(void)state;
	material_library = "";
	check_reflectances(OBJ(BSDF("name='gold leaf'", "0.25") BSDF("name='glass'", "0.5")), 0.25, 0.5, NULL);
	check_reflectances(BSDF("id='a'", "0.125") OBJ("<ref id='a' name='glass'/>" BSDF("name='gold leaf'", "0.25")),
			   0.25, 0.125, NULL);
	/* the last BSDF that applies to a material counts */
	check_reflectances(OBJ(BSDF("", "0.25") BSDF("name='glass'", "0.5")), 0.25, 0.5, NULL);
	check_reflectances(OBJ(BSDF("name='glass'", "0.5") BSDF("", "0.25")), 0.25, 0.25, NULL);
	check_reflectances(
		OBJ(BSDF("name='glass'", "0.5")), -1, 0.5,
		"s.xml:1: <shape type=\"obj\">: 1 of the materials of d/m.obj (first: `gold leaf`) has neither a bsdf nor");
	check_reflectances(OBJ(BSDF("name='glass'", "0.5") BSDF("", "0.25") BSDF("name='nothing'", "0.125")), 0.25,
			   0.25, "no face of d/m.obj has the material `nothing`: this bsdf is not used");
}

/* Each part has all other properties of the shape, and a reference to the shape includes both parts. */
static void test_parts_have_all_properties_of_the_shape(void **state)
{
	(void)state;
	struct scene s = read_valid("<shape type='shapegroup' id='g'>" OBJ(
		"<transform name='toWorld'><scale value='2'/></transform><boolean name='faceNormals' value='true'/>" BSDF(
			"name='glass'", "0.5")) "</shape><shape type='instance'><ref id='g'/></shape>");
	const struct scene_node *merge = node_child(s.objects[0], PLUGIN_SHAPE, 0);
	assert_string_equal(merge->type, "merge");
	for (uint32_t i = 0; i < 2; i++) {
		const struct scene_node *part = node_child(merge, PLUGIN_SHAPE, i);
		assert_true(node_transform(part, "to_world").m[0][0] == 2 && node_bool(part, "face_normals", false));
	}
	assert_int_equal(s.asset_count, 2);
	assert_string_equal(s.assets[1], "d/m/lib.mtl");
	scene_fini(&s);
}

/* A shape of one of the file's meshes (two of gold leaf, glass between them) has its material alone. */
static void test_shape_of_one_mesh_has_its_material(void **state)
{
	(void)state;
	material_library = "newmtl gold leaf\nKd 1 0.5 0\n";
	static const char *const materials[] = {"gold leaf", "glass", "gold leaf"};
	for (int i = 0; i < 3; i++) {
		char xml[512];
		snprintf(xml, sizeof xml,
			 "<emitter type='constant'/>" OBJ("<integer name='shapeIndex' value='%d'/>" BSDF(
				 "name='glass'", "0.5") BSDF("name='nothing'", "0.125")),
			 i);
		struct scene s = read_valid(xml);
		const struct scene_node *merge = find_last_shape(&s);
		assert_string_equal(merge->type, "merge");
		assert_int_equal(merge->child_count, 1);
		const struct scene_node *part = merge->children[0], *bsdf = node_child(part, PLUGIN_BSDF, 0);
		assert_string_equal(node_string(part, "material", ""), materials[i]);
		assert_int_equal(node_int(part, "shape_index", -1), i);
		assert_non_null(bsdf);
		assert_true((node_float(bsdf, "reflectance", -1) == 0.5) == (i == 1));
		scene_fini(&s);
	}
	/* the only named BSDF is of another mesh: this one is grey */
	material_library = "";
	struct scene s = read_valid(
		"<emitter type='constant'/>" OBJ("<integer name='shapeIndex' value='2'/>" BSDF("name='glass'", "0.5")));
	assert_int_equal(find_last_shape(&s)->child_count, 1);
	assert_null(node_child(find_last_shape(&s)->children[0], PLUGIN_BSDF, 0));
	assert_non_null(strstr(s.notes[0], "1 of the materials of d/m.obj (first: `gold leaf`) has neither"));
	scene_fini(&s);
}

static void expect_single_shape(const char *version, const char *content)
{
	struct scene s;
	struct error e;
	assert_int_equal(read_scene(&s, version, content, &e), 0);
	if (s.problem_count)
		fail_msg("%s", s.problems[0]);
	assert_string_equal(find_last_shape(&s)->type, "obj");
	scene_fini(&s);
}

static void test_shapes_of_one_material_are_not_split(void **state)
{
	(void)state;
	material_library = "newmtl glass\nKd 1 1 1\n";
	expect_single_shape("0.6.0", OBJ(BSDF("", "0.25")));
	expect_single_shape("0.6.0", OBJ(BSDF("name='bsdf'", "0.25"))); /* not a material's name: for all faces */
	expect_single_shape("0.6.0", OBJ("<boolean name='loadMaterials' value='false'/>"));
	expect_single_shape("0.6.0", OBJ("<boolean name='collapse' value='true'/>"));
	expect_single_shape("0.6.0", OBJ("<string name='material' value='glass'/>" BSDF("", "0.25")));
	expect_single_shape("0.6.0",
			    OBJ("<integer name='shapeIndex' value='3'/>")); /* refused when it is built: it has 3 */
	expect_single_shape("0.6.0", OBJ("<integer name='shapeIndex' value='0'/>" BSDF("", "0.25")));
	expect_single_shape("3.0.0", OBJ(""));
	expect_single_shape("3.0.0", OBJ(BSDF("name='glass'", "0.25")));
	material_library = "newmtl something else\n";
	expect_single_shape("0.6.0", OBJ(""));
}

/* Returns the BSDF that the .mtl file `text` gives to the material `glass`. */
static const struct scene_node *read_glass_bsdf(struct scene *s, const char *text)
{
	material_library = text;
	*s = read_valid(OBJ(BSDF("name='gold leaf'", "0.25")));
	const struct scene_node *bsdf = node_child(material_part(s, 1), PLUGIN_BSDF, 0);
	assert_non_null(bsdf);
	assert_string_equal(bsdf->file, "d/m/lib.mtl");
	return bsdf;
}

static bool has_rgb(const struct scene_node *n, const char *name, double r, double g, double b)
{
	const struct property *p = node_find_property(n, name);
	const double want[] = {r, g, b};
	for (int i = 0; p && i < 3; i++)
		if (!(fabs(p->value.as.rgb[i] - want[i]) < 1e-4))
			return false;
	return p != NULL;
}

static void test_material_libraries_give_bsdfs(void **state)
{
	(void)state;
	struct scene s;
	material_library = "newmtl glass\nKd 1 1 1\n";
	s = read_valid(OBJ("<emitter type='area'/>")); /* all parts emit light */
	assert_true(node_child(material_part(&s, 0), PLUGIN_EMITTER, 0) &&
		    node_child(material_part(&s, 1), PLUGIN_EMITTER, 0));
	scene_fini(&s);
	const struct scene_node *b = read_glass_bsdf(
		&s, "newmtl gold leaf\nKd 1 1 1\n\tnewmtl glass \r\n Kd 0.5 1 0 # sRGB\r\nKs 1 1 1\nNs 5\n");
	assert_string_equal(b->type, "diffuse"); /* without an illumination model there is no specular reflection */
	assert_int_equal(b->line, 3);
	assert_true(has_rgb(b, "reflectance", 0.21404, 1, 0));
	scene_fini(&s);
	b = read_glass_bsdf(&s, "newmtl glass\nillum 2\nKs 1 0 0\nNs 200.0\n");
	assert_string_equal(b->type, "phong");
	assert_true(has_rgb(b, "diffuse_reflectance", 0, 0, 0) && has_rgb(b, "specular_reflectance", 1, 0, 0));
	assert_true(node_float(b, "exponent", 0) == 200);
	scene_fini(&s);
	b = read_glass_bsdf(&s, "newmtl glass\nillum 2\nKs 0 0 0\nNs 200\nKd 0\n");
	assert_string_equal(b->type, "diffuse");
	scene_fini(&s);
	b = read_glass_bsdf(&s, "newmtl glass\nKd 1 1 1\nnewmtl glass\nillum 7\n"); /* the last definition counts */
	assert_string_equal(b->type, "dielectric");
	scene_fini(&s);
	b = read_glass_bsdf(&s, "newmtl glass\nillum 5\n");
	assert_string_equal(b->type, "conductor");
	assert_string_equal(node_string(b, "material", ""), "Al");
	scene_fini(&s);
	b = read_glass_bsdf(&s, "newmtl glass\nd 0.25\nbump C:\\x\\wood.png\nmap_Kd wood.png\nKd 1 1 1\n");
	assert_true(strcmp(b->type, "mask") == 0 && node_float(b, "opacity", 1) == 0.25);
	b = node_child(b, PLUGIN_BSDF, 0);
	assert_string_equal(b->type, "bumpmap");
	const struct scene_node *bump = node_child(b, PLUGIN_TEXTURE, 0);
	assert_string_equal(node_string(bump, "filename", ""), "d/m/wood.png"); /* in the folder of the .mtl file */
	assert_true(node_float(bump, "gamma", 0) == 1);
	assert_true(has_rgb(node_child(b, PLUGIN_BSDF, 0), "reflectance", 1, 1, 1)); /* Kd comes after the picture */
	assert_string_equal(s.assets[2], "d/m/wood.png");
	scene_fini(&s);
	b = read_glass_bsdf(&s, "newmtl glass\nd 1\nmap_d wood.png\nKd 1 1 1\nmap_Kd wood.png\nmap_Bump wood.png\n");
	assert_string_equal(b->type, "mask");
	assert_string_equal(node_ref(b, "opacity")->type, "bitmap");
	assert_string_equal(node_ref(node_child(b, PLUGIN_BSDF, 0), "reflectance")->type, "bitmap");
	assert_non_null(strstr(s.notes[0], "d/m/lib.mtl:6: `map_Bump` is not read"));
	scene_fini(&s);
}

static void expect_refused(const char *content, const char *text)
{
	struct scene s;
	struct error e;
	assert_int_equal(read_scene(&s, "0.6.0", content, &e), 0);
	if (s.problem_count != 1 || !strstr(s.problems[0], text))
		fail_msg("%u: %s\n not: %s", s.problem_count, s.problem_count ? s.problems[0] : "", text);
	scene_fini(&s);
}

static void test_invalid_material_libraries_are_refused(void **state)
{
	(void)state;
	material_library = "newmtl glass\n\nKd 2 0 0\n";
	expect_refused(OBJ(""), "d/m/lib.mtl:3: <srgb>: reflectance=");
	material_library = "newmtl glass\nKd spectral x.rfl\n";
	expect_refused(OBJ(""), "d/m/lib.mtl:2: <srgb>: `spectral x.rfl` is neither");
	expect_refused("<shape type='obj'><string name='filename' value='n.obj'/>" BSDF("name='a'", "0.5")
			       BSDF("name='b'", "0.5") "</shape>",
		       "s.xml:1: <shape type=\"obj\">: n.obj: no such file");
	expect_refused("<shape type='ply'><string name='filename' value='n'/>" BSDF("name='a'", "0.5")
			       BSDF("name='b'", "0.5") "</shape>",
		       "a second bsdf");
	static char many[(MTL_MATERIALS_MAX + 1) * 16];
	size_t n = 0;
	for (int i = 0; i <= MTL_MATERIALS_MAX; i++)
		n += (size_t)snprintf(many + n, sizeof many - n, "newmtl %d\n", i);
	material_library = many;
	expect_refused(OBJ(""), "d/m/lib.mtl:4097: more than 4096 materials");
}

static void test_number_of_materials_is_limited(void **state)
{
	(void)state;
	static char xml[] = "<scene version='0.6.0'>" OBJ(BSDF("name='7'", "0.5")) "</scene>",
		    obj[(OBJ_MATERIALS_MAX + 1) * 16 + sizeof FACES];
	size_t n = (size_t)snprintf(obj, sizeof obj, FACES);
	for (int i = 0; i < OBJ_MATERIALS_MAX; i++)
		n += (size_t)snprintf(obj + n, sizeof obj - n, "usemtl %d\n", i);
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {"d/m.obj", obj, n}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e), -E2BIG);
	assert_non_null(strstr(e.text, "d/m.obj:4099: more than 4096 materials")); /* the unnamed one counts */
}

/* Each allocation fails once. */
static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	material_library = "newmtl glass\nKd 1 1 1\nmap_Kd a\\b.png\nillum 2\nd 0.5\nbump c.png\n";
	struct scene s;
	struct error e;
	long n = 0;
	int r;
	do {
		mem_fail_after(n++);
		r = read_scene(&s, "0.6.0", OBJ(BSDF("name='gold leaf'", "0.5")), &e);
		assert_true(r == 0 || r == -ENOMEM);
	} while (r && n < 10000);
	mem_fail_after(-1);
	assert_true(n > 5 && s.problem_count == 0);
	assert_int_equal(material_part(&s, 1)->child_count, 1);
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_named_bsdfs_apply_to_their_materials),
		cmocka_unit_test(test_parts_have_all_properties_of_the_shape),
		cmocka_unit_test(test_shape_of_one_mesh_has_its_material),
		cmocka_unit_test(test_shapes_of_one_material_are_not_split),
		cmocka_unit_test(test_material_libraries_give_bsdfs),
		cmocka_unit_test(test_invalid_material_libraries_are_refused),
		cmocka_unit_test(test_number_of_materials_is_limited),
		cmocka_unit_test(test_failed_allocations_are_reported),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
