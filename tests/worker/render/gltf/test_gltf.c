/* SPDX-License-Identifier: Apache-2.0 */
/*
 * glTF against its XML twin (tests/scenes/gltf): the same image, bit by bit, in each form of the file format.
 * Malformed or unsupported files give an error message, and damaged bytes have no other effect.
 */
#include "common/base/mem.h"
#include "tests/support/dice.h"
#include "tests/support/gltf_files.h"
#include "tests/support/render_picture.h"
#include "tests/support/scene_parts.h"
#include "tests/support/worlds.h"
#include "worker/render/shape/shape.h"
#include "worker/render/world/build.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 32 };

static struct picture render(struct world *w)
{
	struct picture out;
	const struct render_picture_options how = {"path", "gltf", 8, 6};
	render_picture_xyz(w, &how, &out);
	world_free(w);
	return out;
}

static void test_gltf_renders_like_its_xml_twin(void **state)
{
	(void)state;
	static struct gltf_files f;
	struct asset_source folder = asset_source_for_folder("tests/scenes/gltf");
	struct asset texture;
	struct error e;
	assert_int_equal(folder.open(folder.user, "rgb.hdr", &texture, &e), 0);
	/* With the choice of emitters by position, the probabilities would depend on the last bits of the cameras,
	 * which differ. */
	worlds_accuracy = "emitter-choice=power";
	struct picture want = render(world_from_own_scene("gltf", "twin.xml", SIDE, SIDE));
	gltf_files_make(&f);
	for (int form = 0; form < GLTF_FORMS; form++) {
		gltf_files_pack(&f, (enum gltf_form)form);
		f.files[2] = (struct memory_file){"rgb.hdr", texture.bytes, texture.size};
		struct picture got = render(world_from_files(SIDE, SIDE, f.files));
		double bright = 0;
		for (int k = 0; k < 3; k++)
			for (size_t i = 0; i < SIDE * SIDE; i++) {
				bright += (double)want.rgb[k][i];
				if (got.rgb[k][i] != want.rgb[k][i])
					fail_msg("form %d, channel %d, pixel %zu: %a, in the twin %a", form, k, i,
						 (double)got.rgb[k][i], (double)want.rgb[k][i]);
			}
		assert_true(bright > 0.01 * SIDE * SIDE);
		picture_fini(&got);
	}
	worlds_accuracy = NULL;
	picture_fini(&want);
	folder.close(folder.user, &texture);
}

/* ---- one change each ---- */

static struct gltf_files changed_files;

static int build_shapes(const struct scene *s, const struct memory_file *files, struct error *e)
{
	struct asset_source assets = memory_assets(files);
	struct arena arena = {.limit = 64 << 20};
	int rc = 0;
	for (uint32_t i = 0; !rc && i < s->object_count; i++) {
		struct shape_geometry g;
		uint64_t dropped;
		if (s->objects[i]->cls == PLUGIN_SHAPE)
			rc = shape_build(s->objects[i], &assets, &arena, &g, &dropped, e);
	}
	arena_fini(&arena);
	return rc;
}

/* Expects an error from the reader, or from building the shapes. */
static void expect_refused(const struct memory_file *files, const char *text)
{
	struct scene s;
	struct error e = {"no error at all"};
	int rc = gltf_files_read(files, false, &s, &e);
	if (!rc) {
		rc = build_shapes(&s, files, &e);
		scene_fini(&s);
	}
	if (rc >= 0 || !strstr(e.text, text))
		fail_msg("gave %d: %s\n not: %s", rc, e.text, text);
}

static const struct {
	const char *from, *to, *text;
} malformed[] = {
	{"\"scene\": 0,", "\"scene\": 0", "s.gltf:1: "},
	{"\"2.0\"", "\"1.0\"", "s.gltf: glTF of version \"1.0\""},
	{"\"2.0\"", "2", "\"version\" is not a string"},
	{"\"scene\": 0", "\"scene\": 1", "there is no scenes[1]"},
	{"\"scene\": 0", "\"scene\": -1", "\"scene\" is not a whole number"},
	{"\"scene\": 0", "\"scene\": 0, \"scene\": 0", "duplicate"},
	{"\"extensionsUsed\": [", "\"extensionsRequired\": [\"EXT_x\"], \"y\": [",
	 "requires the extension EXT_x, which is not supported"},
	{"\"extensionsUsed\": [",
	 "\"extensionsRequired\": [\"EXT_x\", \"KHR_texture_transform\", \"EXT_y\", 1], \"y\": [",
	 "requires the extensions EXT_x, EXT_y, (no text), which are not supported"},
	{"[0, 1, 4, 5, 6]", "[0, 1, 4, 5, 9]", "there is no nodes[9]"},
	{"[0, 1, 4, 5, 6]", "[0, \"1\"]", "not indices"},
	{"\"cameras\": [", "\"cameras\": [1, ", "s.gltf: cameras[0] is not an object"},
	{"\"mesh\": 0,", "\"mesh\": 0, \"skin\": 0,", "there is no skins[0]"},
	{"\"children\": [2, 3]", "\"children\": [2, 1]", "s.gltf:7: nodes[1]: it is its own ancestor"},
	{"\"children\": [2, 3]", "\"children\": [2, 0.5]", "nodes[1]: its children are not indices"},
	{"\"rotation\": [1, 0, 0, 0]", "\"rotation\": [0, 0, 0, 0]", "nodes[4]: its rotation is not a quaternion"},
	{"\"rotation\": [1, 0, 0, 0]", "\"rotation\": [1, 0, 0]", "\"rotation\" is not an array of 4 numbers"},
	{"\"yfov\": 0.75", "\"yfov\": 4", "fov"},
	{"\"yfov\": 0.75", "\"yfov\": \"wide\"", "cameras[0]: \"yfov\" is not a number"},
	{"\"point\"", "\"lamp\"", "lights[0]: a light of type \"lamp\""},
	{"\"light\": 0", "\"light\": 7", "there is no lights[7]"},
	{"\"mode\": 5", "\"mode\": 8", "meshes[0]: a primitive without attributes, or of mode 8"},
	{"\"POSITION\": 9", "\"POSITION\": 99", "there is no accessors[99]"},
	{"\"POSITION\": 9", "\"POSITION\": 3", "accessors[3]: of a type that position cannot have"},
	{"\"POSITION\": 9,", "", "meshes[0]: a primitive has no POSITION"},
	{"\"TEXCOORD_0\": 11", "\"TEXCOORD_0\": 2", "texture coordinates differ"},
	{"\"indices\": 3", "\"indices\": 8", "accessors[8]: of a type that index cannot have"},
	{"{\"bufferView\": 2, ", "{\"bufferView\": 2, \"sparse\": {}, ",
	 "accessors[3]: its sparse part has no indices or values"},
	{"5123, \"count\": 24", "5123, \"count\": 25", "accessors[3]: it exceeds bufferViews[2]"},
	{"5123, \"count\": 24", "5123, \"count\": 23", "not a whole number of triangles"},
	{"5123, \"count\": 24", "5123, \"count\": 1e300", "\"count\" is not a whole number"},
	{"5123, \"count\": 24", "5125, \"count\": 12", "out of range; there are 6 vertices"},
	{"\"byteOffset\": 24, \"componentType\"", "\"byteOffset\": 9007199254740992, \"componentType\"", "exceeds"},
	{"\"byteStride\": 32", "\"byteStride\": 4", "it exceeds bufferViews[5]"},
	{"\"byteOffset\": 593", "\"byteOffset\": 594", "bufferViews[9]: it exceeds buffers[0] of 601 bytes"},
	{"593, \"byteLength\": 8}],\n\"buffers\": [\n{BUFFER \"byteLength\": 601",
	 "690, \"byteLength\": 8}],\n\"buffers\": [\n{BUFFER \"byteLength\": 700", "the mesh.bin has 601 bytes"},
	{"BUFFER", "\"uri\": \"file://host/y.bin\",", "not from a network"},
	{"BUFFER", "\"uri\": \"http://x/y.bin\",", "not from a network"},
	{"BUFFER", "\"uri\": \"../y.bin\",", "%2e%2e/y.bin"},
	{"BUFFER", "\"uri\": \"x%20y/%2E%2e/.%2e/y%25.bin\",", "%2e%2e/y%.bin"},
	{"BUFFER", "\"uri\": \"..\\\\x\\\\y%5C.bin\",", "%2e%2e/x/y\\.bin"},
	{"BUFFER", "\"uri\": \"a%00b\",", "its uri is not the name of a file"},
	{"BUFFER", "\"uri\": \"data:text/plain,abc\",", "buffers[0]: its embedded data is not base64"},
	{"BUFFER", "\"uri\": \"data:;base64,AAAA\",", "buffers[0]: it states 601 bytes but has 3"},
	{"\"index\": 0},", "\"index\": 3},", "there is no textures[3]"},
	{"{\"source\": 0, ", "{", "images of unknown_format are not supported"},
	{"\"roughnessFactor\": 0.5", "\"roughnessFactor\": 1.5", "s.gltf:25: <float>: roughness=1.5 is outside [0, 1]"},
	/* a known attribute with an unsupported type */
	{"\"TEXCOORD_0\": 11", "\"TEXCOORD_0\": 11, \"COLOR_0\": 11", "of a type that color cannot have"},
	{"\"TEXCOORD_0\": 2}", "\"TEXCOORD_0\": 2, \"COLOR_0\": 9}",
	 "`color` has another number of entries than `position`"},
	{"\"KHR_materials_ior\": {\"ior\": 1.75}", "\"KHR_materials_volume\": {\"attenuationDistance\": \"2\"}",
	 "\"attenuationDistance\" is not a number"},
	{"\"KHR_materials_ior\": {\"ior\": 1.75}",
	 "\"KHR_materials_clearcoat\": {\"clearcoatFactor\": 1, \"clearcoatTexture\": {}}",
	 "a texture without an index"},
	{"\"mesh\": 0,", "\"mesh\": 0, \"extensions\": {\"EXT_mesh_gpu_instancing\": {}},",
	 "nodes[0]: EXT_mesh_gpu_instancing without instances"},
};

static void test_malformed_files_are_refused(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof malformed / sizeof *malformed; i++) {
		bool buffer = strcmp(malformed[i].from, "BUFFER") == 0; /* a placeholder that packing fills in */
		const struct memory_file *files =
			gltf_files_make_changed(&changed_files, buffer ? NULL : malformed[i].from, malformed[i].to);
		if (buffer) {
			gltf_files_replace(&changed_files, "BUFFER", malformed[i].to);
			changed_files.files[0].size = changed_files.file_size = strlen(changed_files.json);
			memcpy(changed_files.file, changed_files.json, changed_files.file_size);
		}
		expect_refused(files, malformed[i].text);
	}
}

static void test_malformed_binary_containers_are_refused(void **state)
{
	(void)state;
	static const struct {
		size_t at;
		unsigned char value;
		const char *text;
	} damage[] = {
		{4, 1, "a GLB file of version 1"},
		{10, 9, "its header says"},
		{14, 9, "a chunk exceeds the file"},
		{16, 'X', "a GLB file begins with JSON"},
		{20, 'x', "s.glb:1: "},
		{0, 'x', "s.glb:1: "},
	};
	for (size_t i = 0; i < sizeof damage / sizeof *damage; i++) {
		gltf_files_make(&changed_files);
		gltf_files_pack(&changed_files, GLTF_BINARY);
		changed_files.file[damage[i].at] = damage[i].value;
		expect_refused(changed_files.files, damage[i].text);
	}
	gltf_files_make(&changed_files);
	gltf_files_pack(&changed_files, GLTF_BINARY);
	changed_files.files[0].size -= changed_files.buffer_size;
	expect_refused(changed_files.files, "its header says");
}

/* The limit on values applies before jansson allocates memory for them; brackets within text do not count. */
static void test_too_many_values_are_refused(void **state)
{
	(void)state;
	enum { SIZE = 9 << 20 };
	char *text = mem_alloc(SIZE, 1);
	assert_non_null(text);
	struct memory_file files[] = {{"s.gltf", text, SIZE}, {0}};
	for (int i = 0; i < SIZE; i++)
		text[i] = i % 2 ? '[' : ']';
	text[0] = '[';
	expect_refused(files, "more than 4194304 values");
	memset(text, '[', SIZE);
	memcpy(text, "{\"a\\\"\": \"", 9);
	expect_refused(files, "s.gltf:1: ");
	mem_free(text);
}

/* Damaged bytes of a small file, and prefixes of the file, give a scene or an error message. */
static void test_damaged_files_are_read_or_refused(void **state)
{
	(void)state;
	struct dice d = dice_for_test("damaged glTF");
	for (int form = 0; form < GLTF_FORMS; form++)
		for (int i = 0; i < 400; i++) {
			gltf_files_make(&changed_files);
			gltf_files_pack(&changed_files, (enum gltf_form)form);
			size_t at = dice_below(&d, (uint32_t)changed_files.file_size);
			if (i % 4 == 0)
				changed_files.files[0].size = at;
			else
				changed_files.file[at] = (unsigned char)dice_below(&d, 256);
			struct scene s;
			struct error e = {""};
			int rc = gltf_files_read(changed_files.files, i % 2, &s, &e);
			if (!rc) {
				rc = build_shapes(&s, changed_files.files, &e);
				scene_fini(&s);
			}
			assert_true(rc == 0 || (rc < 0 && *e.text));
		}
}

/* ---- the resulting materials, cameras and lights ---- */

static const struct scene_node *find_object(const struct scene *s, enum plugin_class cls, const char *type)
{
	for (uint32_t i = 0; i < s->object_count; i++)
		if (s->objects[i]->cls == cls && strcmp(s->objects[i]->type, type) == 0)
			return s->objects[i];
	fail_msg("there is no %s", type);
	return NULL;
}

static void assert_near(double got, double want)
{
	if (!(fabs(got - want) <= 1e-12 * fabs(want)))
		fail_msg("%.17g is not %.17g", got, want);
}

static void test_lights_and_cameras_are_converted(void **state)
{
	(void)state;
	struct scene s = gltf_files_read_changed(
		"\"type\": \"point\"",
		"\"type\": \"spot\", \"spot\": {\"innerConeAngle\": 0.25, \"outerConeAngle\": 0.5}", false);
	const struct scene_node *spot = find_object(&s, PLUGIN_EMITTER, "spot");
	mat4 m = node_transform(spot, "to_world");
	assert_near(node_float(spot, "cutoff_angle", 0), 0.5 * 180 / M_PI);
	assert_near(node_float(spot, "beam_width", 0), 0.25 * 180 / M_PI);
	assert_true(m.m[2][2] == -1 && m.m[0][3] == 2 && m.m[2][3] == 2); /* the light emits along -z */
	scene_fini(&s);
	s = gltf_files_read_changed("\"type\": \"point\"", "\"type\": \"directional\"", false);
	m = node_transform(find_object(&s, PLUGIN_EMITTER, "directional"), "to_world");
	assert_true(m.m[2][2] == -1);
	scene_fini(&s);
	s = gltf_files_read_changed("\"perspective\": {", "\"orthographic\": {\"xmag\": 2, \"ymag\": 1}, \"x\": {",
				    false);
	const struct scene_node *sensor = find_object(&s, PLUGIN_SENSOR, "orthographic");
	m = node_transform(sensor, "to_world");
	assert_true(m.m[0][0] == -2 && m.m[1][1] == 2 && m.m[2][2] == -1 && m.m[2][3] == 6);
	assert_int_equal(node_int(node_child(sensor, PLUGIN_FILM, 0), "height", 0), 384);
	assert_false(scene_has_note(&s, "xmag"));
	scene_fini(&s);
	/* The format advises against negative factors, but does not forbid them. */
	s = gltf_files_read_changed("\"perspective\": {", "\"orthographic\": {\"xmag\": -2, \"ymag\": -1}, \"x\": {",
				    false);
	sensor = find_object(&s, PLUGIN_SENSOR, "orthographic");
	m = node_transform(sensor, "to_world");
	assert_true(m.m[0][0] == -2 && m.m[1][1] == 2 && m.m[2][2] == -1 && m.m[2][3] == 6);
	assert_int_equal(node_int(node_child(sensor, PLUGIN_FILM, 0), "height", 0), 384);
	assert_true(scene_has_note(&s, "the signs of xmag and ymag are ignored"));
	scene_fini(&s);
}

/* Blender's lamps are in lumens since version 3.4, its emission never is; its diffuse surfaces are those of the
 * format since 4.0. */
static void test_units_follow_the_version_of_blender(void **state)
{
	(void)state;
	static const struct {
		const char *generator;
		double scale;
		bool lambertian;
	} files[] = {
		{"\"Khronos glTF Blender I/O v3.4.50\"", 1.0 / 683, false},
		{"\"Khronos glTF Blender I/O v4.0.1\"", 1.0 / 683, true},
		{"\"Khronos glTF Blender I/O v3.3.27\"", 1, false},
		{"\"Khronos glTF Blender I/O v\"", 1, true},
		{"\"Another v3.4.50\"", 1, true},
		{"3.4", 1, true},
	};
	for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
		char asset[128];
		snprintf(asset, sizeof asset, "{\"generator\": %s, \"version\": \"2.0\"}", files[i].generator);
		struct scene s = gltf_files_read_changed("{\"version\": \"2.0\"}", asset, false);
		const double *rgb =
			node_find_property(find_object(&s, PLUGIN_EMITTER, "point"), "intensity")->value.as.rgb;
		for (int k = 0; k < 3; k++)
			assert_near(rgb[k], (4 >> k) * files[i].scale);
		assert_true(scene_has_note(&s, "lamps are divided by 683") == (files[i].scale < 1));
		const struct scene_node *bsdf = find_object(&s, PLUGIN_BSDF, "principled");
		assert_true(node_bool(bsdf, "lambertian", false) == files[i].lambertian);
		scene_fini(&s);
	}
}

/* The camera that stands in has the scene's whole box within its field of view. */
static void test_missing_camera_and_light_are_replaced(void **state)
{
	(void)state;
	gltf_files_make(&changed_files);
	gltf_files_replace(&changed_files, "\"camera\": 0,", "");
	gltf_files_replace(&changed_files, "\"emissiveFactor\": [1, 0.5, 0.5],", "");
	gltf_files_replace(&changed_files, "{\"translation\": [2, 2, 2], \"ext", "{\"translation\": [2, 2, 2], \"ext_");
	struct scene s = gltf_files_read_packed(&changed_files, GLTF_EXTERNAL);
	assert_true(scene_has_note(&s, "it has no camera") && scene_has_note(&s, "it has no light") &&
		    scene_has_note(&s, "points and lines"));
	find_object(&s, PLUGIN_EMITTER, "constant");
	mat4 m = node_transform(find_object(&s, PLUGIN_SENSOR, "perspective"), "to_world");
	vec3 eye = {m.m[0][3], m.m[1][3], m.m[2][3]}, ahead = {m.m[0][2], m.m[1][2], m.m[2][2]};
	for (int i = 0; i < 8; i++) {
		vec3 corner = {i & 1 ? 4 : -4, i & 2 ? 3 : -1, i & 4 ? 4 : -4}, to = vec3_sub(corner, eye);
		assert_true(vec3_dot(vec3_normalize(to), ahead) > cos(20 * M_PI / 180));
	}
	scene_fini(&s);
}

static unsigned count_objects(const struct scene *s, enum plugin_class cls)
{
	unsigned n = 0;
	for (uint32_t i = 0; i < s->object_count; i++)
		n += s->objects[i]->cls == cls;
	return n;
}

/* A Draco-compressed mesh is read if its accessors contain the numbers as well. */
static void test_draco_is_accepted_with_uncompressed_numbers(void **state)
{
	(void)state;
	struct scene s = gltf_files_read_changed(NULL, NULL, false);
	unsigned shapes = count_objects(&s, PLUGIN_SHAPE);
	scene_fini(&s);
	gltf_files_make(&changed_files);
	gltf_files_replace(&changed_files, "\"mode\": 5,",
			   "\"mode\": 5, \"extensions\": {\"KHR_draco_mesh_compression\": {\"bufferView\": 0}},");
	s = gltf_files_read_packed(&changed_files, GLTF_EXTERNAL);
	assert_int_equal(count_objects(&s, PLUGIN_SHAPE), shapes);
	assert_false(scene_has_note(&s, "Draco") || scene_has_note(&s, "draco"));
	scene_fini(&s);
	gltf_files_replace(&changed_files, "\"extensionsUsed\"",
			   "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"extensionsUsed\"");
	gltf_files_replace(&changed_files, "{\"bufferView\": 6, ", "{");
	gltf_files_pack(&changed_files, GLTF_EXTERNAL);
	expect_refused(changed_files.files,
		       "meshes[0]: compressed by Draco (KHR_draco_mesh_compression), which is not supported; "
		       "export without compression");
}

#define HIDDEN(value) "\"extensions\": {\"KHR_node_visibility\": {" value "}"

/* Shapes and lights of a hidden node and of its descendants are absent, but its camera is present. */
static void test_hidden_nodes_are_left_out(void **state)
{
	(void)state;
	static const struct {
		const char *from, *to;
		unsigned shapes, points;
	} cases[] = {
		{"\"children\": [2, 3]", "\"children\": [2, 3], " HIDDEN("\"visible\": false") "}", 2, 1},
		{"\"children\": [2, 3]", "\"children\": [2, 3], " HIDDEN("") "}", 4, 1},
		{"{\"camera\": 0", "{" HIDDEN("\"visible\": false") "}, \"camera\": 0", 4, 1},
		{"{\"translation\": [2, 2, 2], \"extensions\": {",
		 "{\"translation\": [2, 2, 2], " HIDDEN("\"visible\": false") ", ", 4, 0},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct scene s = gltf_files_read_changed(cases[i].from, cases[i].to, false);
		unsigned points = 0;
		for (uint32_t k = 0; k < s.object_count; k++)
			points += strcmp(s.objects[k]->type, "point") == 0;
		assert_int_equal(count_objects(&s, PLUGIN_SHAPE), cases[i].shapes);
		assert_int_equal(points, cases[i].points);
		assert_false(scene_has_note(&s, "no camera") || scene_has_note(&s, "not supported"));
		scene_fini(&s);
	}
}

/* Ignored extensions and properties get a note. */
static void test_ignored_extensions_are_noted(void **state)
{
	(void)state;
	gltf_files_make(&changed_files);
	gltf_files_replace(&changed_files, "\"extensionsUsed\": [\"KHR_lights_punctual\"]",
			   "\"extensionsUsed\": [\"KHR_lights_punctual\", \"ACME_fog\", \"ACME_wind\"]");
	gltf_files_replace(&changed_files, "\"intensity\": ", "\"range\": 5, \"intensity\": ");
	struct scene s = gltf_files_read_packed(&changed_files, GLTF_EXTERNAL);
	assert_true(scene_has_note(&s, "these extensions are not supported and ignored: ACME_fog, ACME_wind"));
	assert_true(scene_has_note(&s, "ranges of lights are ignored"));
	scene_fini(&s);
	/* Levels of less detail are left out. What is required, and therefore refused, is not said to be
	 * ignored. */
	gltf_files_make(&changed_files);
	gltf_files_replace(&changed_files, "\"extensionsUsed\": [",
			   "\"extensionsRequired\": [\"MSFT_lod\"], \"extensionsUsed\": [\"MSFT_lod\", ");
	s = gltf_files_read_packed(&changed_files, GLTF_EXTERNAL);
	assert_false(scene_has_note(&s, "not supported"));
	scene_fini(&s);
	gltf_files_make(&changed_files);
	gltf_files_replace(
		&changed_files, "\"extensionsUsed\": [",
		"\"extensionsRequired\": [\"ACME_fog\"], \"extensionsUsed\": [\"ACME_fog\", \"ACME_wind\", ");
	gltf_files_pack(&changed_files, GLTF_EXTERNAL);
	struct asset_source assets = memory_assets(changed_files.files);
	struct error e;
	assert_int_equal(scene_read_all(&s, &assets, "s.gltf", render_plugins(), NULL, 0, false, &e), 0);
	assert_int_equal(s.problem_count, 1);
	assert_non_null(strstr(s.problems[0], "requires the extension ACME_fog"));
	assert_true(scene_has_note(&s, "not supported and ignored: ACME_wind"));
	scene_fini(&s);
}

/* Files that the format forbids or leaves undefined, but that other readers accept. */
static void test_loose_files_are_accepted(void **state)
{
	(void)state;
	struct gltf_files f;
	struct scene s, whole = gltf_files_read_changed(NULL, NULL, false);
	gltf_files_make(&f); /* with a byte order mark */
	memmove(f.json + 3, f.json, strlen(f.json) + 1);
	memcpy(f.json, "\xef\xbb\xbf", 3);
	s = gltf_files_read_packed(&f, GLTF_BINARY);
	assert_int_equal(s.object_count, whole.object_count);
	scene_fini(&s);
	gltf_files_make(&f); /* JSON padded with zeros */
	strcat(f.json, "  ");
	gltf_files_pack(&f, GLTF_BINARY);
	for (size_t at = 19 + f.file[12] + 256u * f.file[13]; f.file[at] != '}'; at--)
		f.file[at] = 0;
	assert_int_equal(gltf_files_read(f.files, false, &s, &(struct error){""}), 0);
	assert_int_equal(s.object_count, whole.object_count);
	scene_fini(&s);
	gltf_files_make(&f); /* without scenes: the same nodes are roots */
	gltf_files_replace(&f, "\"scene\": 0", "\"extras\": 0");
	gltf_files_replace(&f, "\"scenes\"", "\"other\"");
	s = gltf_files_read_packed(&f, GLTF_BINARY);
	assert_int_equal(s.object_count, whole.object_count);
	assert_true(scene_has_note(&s, "it has no scenes: all of its nodes are shown"));
	scene_fini(&s);
	scene_fini(&whole);
	/* ... but not levels of less detail */
#define TRIANGLE(levels)                                                                                                 \
	"{\"asset\": {\"version\": \"2.0\"}, \"buffers\": [{\"byteLength\": 36, \"uri\": \"data:;base64,"                \
	"AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": 36}], " \
	"\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"}], \"meshes\": "  \
	"[{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], \"nodes\": [{\"mesh\": 0" levels                     \
	"}, {\"mesh\": 0}]}"
	static const char *const levels[] = {
		TRIANGLE(""), TRIANGLE(", \"extensions\": {\"MSFT_lod\": {\"ids\": [1, -1, 7, \"x\"]}}")};
	uint32_t object_counts[2];
	for (int i = 0; i < 2; i++) {
		const struct memory_file level_files[] = {{"s.gltf", levels[i], strlen(levels[i])}, {NULL, NULL, 0}};
		assert_int_equal(gltf_files_read(level_files, false, &s, &(struct error){""}), 0);
		object_counts[i] = (uint32_t)s.object_count;
		scene_fini(&s);
	}
	assert_int_equal(object_counts[1], object_counts[0] - 1);
	/* a picture with an absolute path, and one that the exporter lost */
	struct error e;
	const struct memory_file *files = gltf_files_make_changed(&f, "\"rgb.hdr\"", "\"file:///x/rgb.hdr\"");
	assert_int_equal(gltf_files_read(files, false, &s, &e), 0);
	assert_string_equal(s.assets[s.asset_count - 1], "the mesh.bin");
	assert_string_equal(s.assets[0], "%2f/x/rgb.hdr");
	scene_fini(&s);
	s = gltf_files_read_changed("{\"source\": 0, ", "{", true);
	assert_true(scene_has_note(&s, "unknown_format"));
	scene_fini(&s);
}

/* A mesh that a scale of 0 reduces to a point or a line is left out; one reduced to a sheet is refused. */
static void test_meshes_without_area_are_left_out(void **state)
{
	(void)state;
	static const char scale[] = "\"scale\": [4, 1, 4]";
	struct scene whole = gltf_files_read_changed(NULL, NULL, false),
		     s = gltf_files_read_changed(scale, "\"scale\": [0, 0, 0]", false);
	assert_true(s.object_count < whole.object_count);
	assert_true(scene_has_note(&s, "the mesh of 1 node, which a scale of 0 makes a line or a point, is left out "
				       "(first: nodes["));
	scene_fini(&s);
	s = gltf_files_read_changed(scale, "\"scale\": [0, 1, 0]", false);
	assert_true(s.object_count < whole.object_count);
	scene_fini(&s);
	scene_fini(&whole);
	struct gltf_files f;
	struct error e;
	assert_true(gltf_files_read(gltf_files_make_changed(&f, scale, "\"scale\": [4, 0, 4]"), false, &s, &e));
	assert_non_null(strstr(e.text, "flattens the shape"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_gltf_renders_like_its_xml_twin),
		cmocka_unit_test(test_malformed_files_are_refused),
		cmocka_unit_test(test_malformed_binary_containers_are_refused),
		cmocka_unit_test(test_too_many_values_are_refused),
		cmocka_unit_test(test_damaged_files_are_read_or_refused),
		cmocka_unit_test(test_lights_and_cameras_are_converted),
		cmocka_unit_test(test_missing_camera_and_light_are_replaced),
		cmocka_unit_test(test_units_follow_the_version_of_blender),
		cmocka_unit_test(test_draco_is_accepted_with_uncompressed_numbers),
		cmocka_unit_test(test_hidden_nodes_are_left_out),
		cmocka_unit_test(test_ignored_extensions_are_noted),
		cmocka_unit_test(test_loose_files_are_accepted),
		cmocka_unit_test(test_meshes_without_area_are_left_out),
	};
	return cmocka_run_group_tests_name("gltf", tests, NULL, NULL);
}
