/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Less usual glTF files: several sets of texture coordinates, unlit materials, accessors without bounds, files
 * without cameras and lights, version 1, and specular-glossiness materials; and the names that the reader gives to
 * shapes.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "worker/render/render.h"
#include "worker/render/scene/scene.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* Set 0 begins at byte 36, set 1 at byte 60. */
#define FILE_OF(version, material, more, bounds)                                                                    \
	"{\"asset\": {\"version\": " version                                                                        \
	"}, \"scene\": 0, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0}],"                              \
	"\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0, \"TEXCOORD_0\": 1, \"TEXCOORD_1\": 2},"  \
	"\"material\": 0}]}], \"materials\": [{\"pbrMetallicRoughness\": {" material "}" more "}],"                 \
	"\"textures\": [{\"source\": 0}], \"images\": [{\"uri\": \"p.png\"}],"                                      \
	"\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"" bounds "}," \
	"{\"bufferView\": 0, \"byteOffset\": 36, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC2\"},"       \
	"{\"bufferView\": 0, \"byteOffset\": 60, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC2\"}],"      \
	"\"bufferViews\": [{\"buffer\": 0, \"byteLength\": 84}], \"buffers\": [{\"uri\": \"b.bin\", \"byteLength\": 84}]}"
#define BOUNDS ", \"min\": [0, 0, 0], \"max\": [1, 1, 0]"
#define FIRST "\"baseColorTexture\": {\"index\": 0}"
#define SECOND "\"baseColorTexture\": {\"index\": 0, \"texCoord\": 1}"
#define BOTH(set) "\"metallicRoughnessTexture\": {\"index\": 0, \"texCoord\": " set "}"

#define NORMAL(set) ", \"normalTexture\": {\"index\": 0, \"texCoord\": " set "}"

static struct scene read_text(const char *json)
{
	const struct memory_file files[] = {{"s.gltf", json, strlen(json)}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	if (scene_read_all(&s, &assets, "s.gltf", render_plugins(), NULL, 0, false, &e))
		fail_msg("%s", e.text);
	return s;
}

static const struct scene_node *find_shape(const struct scene *s)
{
	if (s->problem_count)
		fail_msg("%s", s->problems[0]);
	for (uint32_t i = 0; i < s->object_count; i++)
		if (s->objects[i]->cls == PLUGIN_SHAPE)
			return s->objects[i];
	fail_msg("there is no shape");
	return NULL;
}

static void expect_texcoord(const char *json, const char *first_byte)
{
	struct scene s = read_text(json);
	const char *texcoord = node_string(find_shape(&s), "texcoord", "");
	if (!strstr(texcoord, first_byte))
		fail_msg("%s\n takes %s", json, texcoord);
	scene_fini(&s);
}

static void expect_refused(const char *json, const char *sentence)
{
	struct scene s = read_text(json);
	if (!s.problem_count || !strstr(s.problems[0], sentence))
		fail_msg("%u: %s\n not: %s", s.problem_count, s.problem_count ? s.problems[0] : "", sentence);
	scene_fini(&s);
}

static void test_texture_coordinate_set_is_selected(void **state)
{
	(void)state;
	expect_texcoord(FILE_OF("\"2.0\"", FIRST, "", BOUNDS), "36");
	expect_texcoord(FILE_OF("\"2.0\"", SECOND, "", BOUNDS), "60");
	expect_texcoord(FILE_OF("\"2.0\"", SECOND "," BOTH("1"), NORMAL("1"), BOUNDS), "60");
	expect_texcoord(
		FILE_OF("\"2.0\"",
			"\"baseColorTexture\": {\"index\": 0, \"extensions\": {\"KHR_texture_transform\": {\"texCoord\": 1}}}",
			"", BOUNDS),
		"60");
	expect_refused(FILE_OF("\"2.0\"", FIRST "," BOTH("1"), NORMAL("2"), BOUNDS),
		       "`texCoord` is not supported; --lenient leaves it out");
}

static const struct scene_node *find_material(const struct scene *s)
{
	for (uint32_t i = 0; i < s->object_count; i++)
		if (s->objects[i]->cls == PLUGIN_BSDF)
			return s->objects[i];
	fail_msg("there is no material");
	return NULL;
}

/* Returns the coordinates by which the image of a property is looked up. */
static const char *image_coordinates(const struct scene_node *bsdf, const char *name)
{
	const struct property *p = node_find_property(bsdf, name);
	assert_non_null(p);
	return node_string(p->value.as.node, "coordinates", "");
}

/* One set becomes that of the shape, preferably the normal map's; the other becomes an attribute. */
static void test_second_set_becomes_an_attribute(void **state)
{
	(void)state;
	struct scene s = read_text(FILE_OF("\"2.0\"", FIRST "," BOTH("1"), "", BOUNDS));
	assert_true(strstr(node_string(find_shape(&s), "texcoord", ""), "36") ==
		    node_string(find_shape(&s), "texcoord", ""));
	assert_string_equal(node_string(find_shape(&s), "texcoord_other", ""), "60 8 3 f32");
	assert_string_equal(image_coordinates(find_material(&s), "base_color"), "");
	assert_string_equal(image_coordinates(find_material(&s), "metallic"), "vertex_texcoord");
	assert_string_equal(image_coordinates(find_material(&s), "roughness"), "vertex_texcoord");
	scene_fini(&s);
	s = read_text(FILE_OF("\"2.0\"", SECOND, NORMAL("0"), BOUNDS));
	assert_string_equal(node_string(find_shape(&s), "texcoord", ""), "36 8 3 f32");
	assert_string_equal(node_string(find_shape(&s), "texcoord_other", ""), "60 8 3 f32");
	const struct scene_node *bent = node_child(find_material(&s), PLUGIN_BSDF, 0);
	assert_string_equal(image_coordinates(bent, "base_color"), "vertex_texcoord");
	scene_fini(&s);
}

/* Unlit materials are rendered as lit ones, with a note; a file that requires the extension is refused. */
static void test_unlit_materials_are_rendered_as_lit(void **state)
{
	(void)state;
#define UNLIT ", \"extensions\": {\"KHR_materials_unlit\": {}}"
	struct scene s = read_text(FILE_OF("\"2.0\"", FIRST, UNLIT, BOUNDS));
	find_shape(&s);
	assert_true(scene_has_note(&s, "surfaces of KHR_materials_unlit are lit like others"));
	scene_fini(&s);
	expect_refused(FILE_OF("\"2.0\"", FIRST,
			       UNLIT "}], \"extensionsRequired\": [\"KHR_materials_unlit\"], \"cameras\": [{", BOUNDS),
		       "`KHR_materials_unlit` is not supported; --lenient leaves it out");
}

static void test_other_versions_are_refused(void **state)
{
	(void)state;
	expect_refused(FILE_OF("1.0", FIRST, "", BOUNDS), "glTF of version 1; 2.0 is supported");
	expect_refused(FILE_OF("\"1.0\"", FIRST, "", BOUNDS), "glTF of version \"1.0\"; 2.0 is supported");
}

/* Without bounds, no camera can be placed before the meshes are read, so the scene has none. */
static void test_no_camera_is_placed_without_bounds(void **state)
{
	(void)state;
	for (int bounds = 0; bounds < 2; bounds++) {
		struct scene s =
			read_text(bounds ? FILE_OF("\"2.0\"", FIRST, "", BOUNDS) : FILE_OF("\"2.0\"", FIRST, "", ""));
		int sensors = 0;
		assert_string_equal(find_shape(&s)->id, "shape 1, of meshes[0]");
		for (uint32_t i = 0; i < s.object_count; i++)
			sensors += s.objects[i]->cls == PLUGIN_SENSOR;
		assert_int_equal(sensors, bounds);
		scene_fini(&s);
	}
}

/* A material that glows like a screen needs other light in the scene; a lamp is enough light. */
static void test_only_glowing_scenes_get_other_light(void **state)
{
	(void)state;
#define GLOWS(more) FILE_OF("\"2.0\"", FIRST, ", \"emissiveFactor\": [1, 0.5, 0]" more, BOUNDS)
	for (int strong = 0; strong < 2; strong++) {
		struct scene s = read_text(
			strong ? GLOWS(", \"extensions\": {\"KHR_materials_emissive_strength\": {\"emissiveStrength\": 1.5}}")
			       : GLOWS(""));
		int skies = 0;
		assert_non_null(node_child(find_shape(&s), PLUGIN_EMITTER, 0)); /* the shape emits light in any case */
		for (uint32_t i = 0; i < s.object_count; i++)
			skies += s.objects[i]->cls == PLUGIN_EMITTER && strcmp(s.objects[i]->type, "constant") == 0;
		assert_int_equal(skies, !strong);
		scene_fini(&s);
	}
}

/* Base colour and metalness are those from which the two colours were computed. */
static void test_specular_glossiness_becomes_metallic_roughness(void **state)
{
	(void)state;
	static const struct {
		const char *more;
		double base[3], metallic, roughness;
	} cases[] = {
		{"\"diffuseFactor\": [0.5, 0.25, 0.125, 1], \"specularFactor\": [0.04, 0.04, 0.04], \"glossinessFactor\": 0.75",
		 {0.5, 0.25, 0.125},
		 0,
		 0.25},
		{"\"diffuseFactor\": [0, 0, 0, 1], \"specularFactor\": [1, 0.75, 0.25]", {1, 0.75, 0.25}, 1, 0},
		{"\"diffuseFactor\": [0.42352941176, 0.42352941176, 0.42352941176, 1], \"specularFactor\": [0.32, 0.32, 0.32]",
		 {0.6, 0.6, 0.6},
		 0.5,
		 0},
		{"\"diffuseFactor\": [0.5, 0.25, 0.125, 1], \"specularGlossinessTexture\": {\"index\": 0}",
		 {0.5, 0.25, 0.125},
		 0,
		 0},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char json[2048];
		snprintf(json, sizeof json,
			 FILE_OF("\"2.0\"", "}, \"extensions\": {\"KHR_materials_pbrSpecularGlossiness\": {%s}", "",
				 BOUNDS),
			 cases[i].more);
		char *metal = strstr(json, "\"pbrMetallicRoughness\": {}, ");
		assert_non_null(metal);
		memset(metal, ' ', strlen("\"pbrMetallicRoughness\": {}, "));
		struct scene s = read_text(json);
		const struct scene_node *bsdf = NULL;
		for (uint32_t k = 0; k < s.object_count; k++)
			if (s.objects[k]->cls == PLUGIN_BSDF)
				bsdf = s.objects[k];
		assert_non_null(bsdf);
		const struct property *base = node_find_property(bsdf, "base_color");
		for (int c = 0; c < 3; c++)
			assert_true(fabs(base->value.as.rgb[c] - cases[i].base[c]) < 1e-6);
		assert_true(fabs(node_float(bsdf, "metallic", -1) - cases[i].metallic) < 1e-6);
		assert_true(fabs(node_float(bsdf, "roughness", -1) - cases[i].roughness) < 1e-6);
		assert_true(scene_has_note(&s, "such materials are not metallic") == (i == 3));
		scene_fini(&s);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_texture_coordinate_set_is_selected),
		cmocka_unit_test(test_second_set_becomes_an_attribute),
		cmocka_unit_test(test_unlit_materials_are_rendered_as_lit),
		cmocka_unit_test(test_other_versions_are_refused),
		cmocka_unit_test(test_no_camera_is_placed_without_bounds),
		cmocka_unit_test(test_only_glowing_scenes_get_other_light),
		cmocka_unit_test(test_specular_glossiness_becomes_metallic_roughness),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
