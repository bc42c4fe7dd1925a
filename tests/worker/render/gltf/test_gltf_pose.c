/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Vertices of glTF that are computed while the file is read: each notation of the same triangle gives this triangle,
 * moved vertices lie where the specification puts them, and instances are at their positions.
 */
#include "common/base/mem.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"
#include "worker/render/render.h"
#include "worker/render/asset/asset_range.h"
#include "worker/render/world/build.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { BUFFERS = 2, BYTES = 4096, JSON = 16384 };

/* A file in memory: its buffers, and its JSON, in which $0 and $1 stand for the buffers. */
static struct {
	unsigned char bytes[BUFFERS][BYTES];
	size_t size[BUFFERS];
	char json[JSON];
	struct memory_file list[2];
} file;

static void begin_file(void)
{
	memset(&file, 0, sizeof file);
}

/* Appends bytes to a buffer; returns their offset. */
static size_t add_bytes(int buffer, const void *bytes, size_t size)
{
	size_t at = file.size[buffer];
	assert_true(at + size <= BYTES);
	memcpy(file.bytes[buffer] + at, bytes, size);
	file.size[buffer] = (at + size + 3) / 4 * 4;
	return at;
}

static void finish_json(const char *json)
{
	size_t n = 0;
	for (const char *p = json; *p; p++) {
		assert_true(n + 8192 < JSON);
		if (*p != '$') {
			file.json[n++] = *p == '\'' ? '"' : *p;
			continue;
		}
		int k = *++p - '0';
		n += (size_t)sprintf(file.json + n, "{\"byteLength\": %zu, \"uri\": \"data:;base64,", file.size[k]);
		asset_range_encode_base64(file.bytes[k], file.size[k], file.json + n);
		n += strlen(file.json + n);
		n += (size_t)sprintf(file.json + n, "\"}");
	}
	file.list[0] = (struct memory_file){"s.gltf", file.json, n};
}

static vec3 triangle_corner(const struct world *w, uint32_t shape, uint32_t triangle, int k)
{
	struct surface_point x;
	surface_on_triangle(&w->shapes[shape], (struct prim_ref){shape, triangle, 0}, k == 1, k == 2, &x);
	return vec3_add(vec3_scale(1 / w->scale, x.p), w->center);
}

static void assert_corner(const struct world *w, uint32_t shape, int k, vec3 want)
{
	vec3 got = triangle_corner(w, shape, 0, k);
	if (!(vec3_length(vec3_sub(got, want)) < 1e-6))
		fail_msg("shape %u, corner %d: %g %g %g, not %g %g %g", shape, k, got.x, got.y, got.z, want.x, want.y,
			 want.z);
}

/* Expects a triangle with corners at the origin, on x and on y, the latter two at the distance `side`. */
static void assert_triangle(const struct world *w, uint32_t shape, vec3 origin, double side)
{
	assert_corner(w, shape, 0, origin);
	assert_corner(w, shape, 1, vec3_add(origin, (vec3){side, 0, 0}));
	assert_corner(w, shape, 2, vec3_add(origin, (vec3){0, side, 0}));
}

static void expect_refused(const char *text)
{
	struct scene s;
	struct error e = {""};
	struct asset_source assets = memory_assets(file.list);
	int rc = scene_read(&s, &assets, "s.gltf", render_plugins(), NULL, 0, &e);
	if (rc == 0 || !strstr(e.text, text))
		fail_msg("%d: %s; not: %s", rc, e.text, text);
}

static const float plain_triangle[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};

/* ---- the same triangle ---- */

#define NODES "'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}], 'nodes': [{'mesh': 0"
#define ONE_BUFFER "'buffers': [$0]"

static void positions_of_each_type_are_read(void **state)
{
	(void)state;
	static const int8_t i8[12] = {0, 0, 0, 0, 127, 0, 0, 0, 0, 127, 0, 0};
	static const uint8_t u8[12] = {0, 0, 0, 0, 3, 0, 0, 0, 0, 3, 0, 0};
	static const int16_t i16[12] = {0, 0, 0, 0, 32767, 0, 0, 0, 0, 32767, 0, 0};
	static const uint16_t u16[12] = {0, 0, 0, 0, 3, 0, 0, 0, 0, 3, 0, 0};
	static const struct {
		const void *bytes;
		size_t size;
		int type, stride;
		const char *normalized;
		double side;
	} cases[] = {{i8, sizeof i8, 5120, 4, "true", 1},
		     {i8, sizeof i8, 5120, 4, "false", 127},
		     {u8, sizeof u8, 5121, 4, "false", 3},
		     {u8, sizeof u8, 5121, 4, "true", 3 / 255.0},
		     {i16, sizeof i16, 5122, 8, "true", 1},
		     {i16, sizeof i16, 5122, 8, "false", 32767},
		     {u16, sizeof u16, 5123, 8, "false", 3},
		     {u16, sizeof u16, 5123, 8, "true", 3 / 65535.0},
		     {plain_triangle, sizeof plain_triangle, 5126, 12, "false", 1}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char json[1024];
		begin_file();
		add_bytes(0, cases[i].bytes, cases[i].size);
		snprintf(json, sizeof json,
			 "{'extensionsRequired': ['KHR_mesh_quantization'], " NODES "}], 'meshes': [{'primitives': "
			 "[{'attributes': {'POSITION': 0}}]}], 'accessors': [{'bufferView': 0, 'componentType': %d, "
			 "'normalized': %s, 'count': 3, 'type': 'VEC3'}], 'bufferViews': [{'buffer': 0, 'byteLength': "
			 "%zu, 'byteStride': %d}], " ONE_BUFFER "}",
			 cases[i].type, cases[i].normalized, cases[i].size, cases[i].stride);
		finish_json(json);
		struct world *w = world_from_files(4, 4, file.list);
		vec3 far = triangle_corner(w, 0, 0, 1);
		if (!(fabs(far.x - cases[i].side) <= 1e-6 * cases[i].side))
			fail_msg("case %zu: %g, not %g", i, far.x, cases[i].side);
		world_free(w);
	}
}

/* Zeros, with two vertices replaced, in a buffer other than that of the indices. */
static void sparse_accessors_replace_vertices(void **state)
{
	(void)state;
	static const uint8_t at[2] = {1, 2};
	static const float values[6] = {1, 0, 0, 0, 1, 0};
	static const uint16_t indices[3] = {0, 1, 2};
	static const char json[] =
		"{" NODES "}], 'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, 'indices': 1}]}], "
		"'accessors': [{'componentType': 5126, 'count': 3, 'type': 'VEC3', 'sparse': {'count': 2, 'indices': "
		"{'bufferView': 0, 'componentType': 5121}, 'values': {'bufferView': 1}}}, {'bufferView': 2, "
		"'componentType': 5123, 'count': 3, 'type': 'SCALAR'}], 'bufferViews': [{'buffer': 0, 'byteLength': 2}, "
		"{'buffer': 0, 'byteOffset': 4, 'byteLength': 24}, {'buffer': 1, 'byteLength': 6}], 'buffers': [$0, $1]}";
	begin_file();
	add_bytes(0, at, sizeof at);
	add_bytes(0, values, sizeof values);
	add_bytes(1, indices, sizeof indices);
	finish_json(json);
	struct world *w = world_from_files(4, 4, file.list);
	assert_triangle(w, 0, (vec3){0, 0, 0}, 1);
	world_free(w);
	char *type = strstr(file.json, "5123"); /* with a signed type, -1 would be an index */
	memcpy(type, "5122", 4);
	expect_refused("accessors[1]: of a type that index cannot have");
	file.bytes[0][1] = 3; /* there is no such vertex */
	finish_json(json);
	expect_refused("accessors[0]: its sparse indices exceed its count");
}

static void meshes_may_use_several_buffers(void **state)
{
	(void)state;
	static const float normals[9] = {0, 0, 1, 0, 0, 1, 0, 0, 1};
	begin_file();
	add_bytes(0, plain_triangle, sizeof plain_triangle);
	add_bytes(1, normals, sizeof normals);
	finish_json(
		"{" NODES "}], 'meshes': [{'primitives': [{'attributes': {'POSITION': 0, 'NORMAL': 1}}]}], "
		"'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}, {'bufferView': 1, "
		"'componentType': 5126, 'count': 3, 'type': 'VEC3'}], 'bufferViews': [{'buffer': 0, 'byteLength': 36}, "
		"{'buffer': 1, 'byteLength': 36}], 'buffers': [$0, $1]}");
	struct world *w = world_from_files(4, 4, file.list);
	assert_triangle(w, 0, (vec3){0, 0, 0}, 1);
	world_free(w);
}

/* ---- moved vertices ---- */

#define TARGETS(node, mesh, count)                                                                                           \
	"{" NODES node "}], 'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, 'targets': [{'POSITION': 1}, "        \
	"{'POSITION': 2}]}]" mesh "}], 'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, "                  \
	"'type': 'VEC3'}, {'bufferView': 1, 'componentType': 5126, 'count': " count                                          \
	", 'type': 'VEC3'}, {'bufferView': "                                                                                 \
	"2, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}], 'bufferViews': [{'buffer': 0, 'byteLength': 36}, "          \
	"{'buffer': 0, 'byteOffset': 36, 'byteLength': 36}, {'buffer': 0, 'byteOffset': 72, 'byteLength': 36}], " ONE_BUFFER \
	"}"

static void morph_targets_move_vertices(void **state)
{
	(void)state;
	static const float up[9] = {0, 0, 1, 0, 0, 1, 0, 0, 1}, larger[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
	static const struct {
		const char *json;
		double z, side;
	} cases[] = {{TARGETS("", ", 'weights': [0, 0]", "3"), 0, 1},
		     {TARGETS("", ", 'weights': [0.5, 2]", "3"), 0.5, 3},
		     {TARGETS(", 'weights': [-1, 0]", ", 'weights': [0.5, 2]", "3"), -1, 1}};
	begin_file();
	add_bytes(0, plain_triangle, sizeof plain_triangle);
	add_bytes(0, up, sizeof up);
	add_bytes(0, larger, sizeof larger);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		finish_json(cases[i].json);
		struct world *w = world_from_files(4, 4, file.list);
		assert_triangle(w, 0, (vec3){0, 0, cases[i].z}, cases[i].side);
		world_free(w);
	}
	finish_json(TARGETS("", ", 'weights': [1, 0]", "2"));
	expect_refused("accessors[1]: a morph target has another number of vertices than its primitive");
}

/* Joint 0 stays; joint 1 is moved by (0, 0, 4) below a node of scale 2 at (1, 0, 0), and was bound at (0, 0, 2). The
 * first vertex belongs to joint 0, the second to joint 1, the third to joint 1 with a share of three quarters; the
 * sums of the weights are 1 and 2. */
#define SKIN(joints)                                                                                                                    \
	"{'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0, 1, 2]}], 'nodes': [{'mesh': 0, 'skin': 0, "                 \
	"'translation': [9, 9, 9]}, {}, {'translation': [1, 0, 0], 'scale': [2, 2, 2], 'children': [3]}, {'translation': [0, 0, 4]}], " \
	"'skins': [{'joints': " joints ", 'inverseBindMatrices': 3}], 'meshes': [{'primitives': [{'attributes': "                       \
	"{'POSITION': 0, 'JOINTS_0': 1, 'WEIGHTS_0': 2}}]}], 'accessors': [{'bufferView': 0, 'componentType': 5126, "                   \
	"'count': 3, 'type': 'VEC3'}, {'bufferView': 1, 'componentType': 5121, 'count': 3, 'type': 'VEC4'}, "                           \
	"{'bufferView': 2, 'componentType': 5126, 'count': 3, 'type': 'VEC4'}, {'bufferView': 3, 'componentType': "                     \
	"5126, 'count': 2, 'type': 'MAT4'}], 'bufferViews': [{'buffer': 0, 'byteLength': 36}, {'buffer': 0, "                           \
	"'byteOffset': 36, 'byteLength': 12}, {'buffer': 0, 'byteOffset': 48, 'byteLength': 48}, {'buffer': 0, "                        \
	"'byteOffset': 96, 'byteLength': 128}], " ONE_BUFFER "}"

static void skins_move_vertices(void **state)
{
	(void)state;
	static const uint8_t joints[12] = {0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0};
	static const float weights[12] = {1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 1.5f, 0, 0};
	static const float inverse[32] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0,	1,
					  1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -2, 1};
	begin_file();
	add_bytes(0, plain_triangle, sizeof plain_triangle);
	add_bytes(0, joints, sizeof joints);
	add_bytes(0, weights, sizeof weights);
	add_bytes(0, inverse, sizeof inverse);
	finish_json(SKIN("[1, 3]"));
	struct world *w = world_from_files(4, 4, file.list);
	assert_corner(w, 0, 0, (vec3){0, 0, 0});
	assert_corner(w, 0, 1, (vec3){3, 0, 4});
	assert_corner(w, 0, 2, (vec3){0.75, 1.75, 3});
	world_free(w);
	finish_json(SKIN("[1]"));
	expect_refused("accessors[1]: vertex 1 has a joint that its skin does not have");
	finish_json(SKIN("[1, 3, 2]"));
	expect_refused("accessors[3]: fewer matrices than skins[0] has joints");
	finish_json(SKIN("[]"));
	expect_refused("skins[0]: it has no joints");
	finish_json(SKIN("[1, 30]"));
	expect_refused("there is no nodes[30]");
}

/* ---- instances ---- */

#define INSTANCES(scale_count)                                                                                      \
	"{'extensionsRequired': ['EXT_mesh_gpu_instancing'], " NODES ", 'translation': [10, 0, 0], 'extensions': "  \
	"{'EXT_mesh_gpu_instancing': {'attributes': {'TRANSLATION': 1, 'SCALE': 2}}}}], 'meshes': [{'primitives': " \
	"[{'attributes': {'POSITION': 0}}]}], 'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, "  \
	"'type': 'VEC3'}, {'bufferView': 1, 'componentType': 5126, 'count': 2, 'type': 'VEC3'}, {'bufferView': 2, " \
	"'componentType': 5126, 'count': " scale_count ", 'type': 'VEC3'}], 'bufferViews': [{'buffer': 0, "         \
	"'byteLength': 36}, {'buffer': 0, 'byteOffset': 36, 'byteLength': 24}, {'buffer': 0, 'byteOffset': 60, "    \
	"'byteLength': 24}], " ONE_BUFFER "}"

static void instancing_extension_places_meshes(void **state)
{
	(void)state;
	static const float places[6] = {1, 2, 3, -1, 0, 0}, scales[6] = {1, 1, 1, 2, 2, 2};
	begin_file();
	add_bytes(0, plain_triangle, sizeof plain_triangle);
	add_bytes(0, places, sizeof places);
	add_bytes(0, scales, sizeof scales);
	finish_json(INSTANCES("2"));
	struct world *w = world_from_files(4, 4, file.list);
	assert_triangle(w, 0, (vec3){11, 2, 3}, 1);
	assert_triangle(w, 1, (vec3){9, 0, 0}, 2);
	world_free(w);
	finish_json(INSTANCES("1"));
	expect_refused("nodes[0]: attributes of instances with different numbers of entries");
	memcpy(strstr(file.json, "\"count\": 2"), "\"count\": 0", 10); /* of TRANSLATION, which comes first */
	expect_refused("nodes[0]: attributes of instances with different numbers of entries");
}

enum { SIDE = 300, CORNERS = SIDE * SIDE * 6 };

/* Writes three nodes with a grid of numbers of the given type. */
static void write_grid(char *json, size_t capacity, int type, int stride, double scale)
{
	snprintf(
		json, capacity,
		"{\"asset\": {\"version\": \"2.0\"}, \"scenes\": [{\"nodes\": [0, 1, 2]}], \"nodes\": [{\"mesh\": 0, "
		"\"scale\": [%g, %g, 1]}, {\"mesh\": 0, \"translation\": [0, 0, 5], \"scale\": [%g, %g, 1]}, {\"mesh\": 0, "
		"\"scale\": [%g, %g, -1]}], \"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], "
		"\"accessors\": [{\"bufferView\": 0, \"componentType\": %d, \"normalized\": %s, \"count\": %d, \"type\": "
		"\"VEC3\", \"min\": [0, 0, 0], \"max\": [%d, %d, 0]}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": %d, "
		"\"byteStride\": %d}], \"buffers\": [{\"byteLength\": %d, \"uri\": \"grid.bin\"}]}",
		scale, scale, scale, scale, scale, scale, type, type == 5126 ? "false" : "true", CORNERS, SIDE, SIDE,
		CORNERS * stride, stride, CORNERS * stride);
}

/* A large mesh shared by several nodes is in memory once; for a mesh of integers that represent -1 to 1, the camera
 * that stands in has the same view. */
static void shared_meshes_are_stored_once(void **state)
{
	(void)state;
	static float grid[CORNERS][3];
	static int16_t whole[CORNERS][4];
	char json[2][2000];
	vec3 eye[2];
	for (int i = 0; i < CORNERS; i++) {
		static const int x[6] = {0, 1, 0, 1, 1, 0}, y[6] = {0, 0, 1, 0, 1, 1};
		whole[i][0] = (int16_t)(i / 6 % SIDE + x[i % 6]);
		whole[i][1] = (int16_t)(i / 6 / SIDE + y[i % 6]);
		grid[i][0] = whole[i][0];
		grid[i][1] = whole[i][1];
	}
	write_grid(json[0], sizeof json[0], 5126, sizeof grid[0], 1);
	write_grid(json[1], sizeof json[1], 5122, sizeof whole[0], 32767);
	for (int i = 0; i < 2; i++) {
		const struct memory_file list[] = {
			{"s.gltf", json[i], strlen(json[i])},
			{"grid.bin", i ? (const void *)whole : grid, i ? sizeof whole : sizeof grid},
			{0}};
		struct world *w = world_from_files(4, 4, list);
		assert_int_equal(w->sharing_shape_count, 3);
		eye[i] = vec3_add(vec3_scale(1 / w->scale, w->camera.position), w->center);
		world_free(w);
	}
	assert_true(eye[0].z > SIDE && vec3_length(vec3_sub(eye[0], eye[1])) < 1e-6 * eye[0].z);
}

/* ---- animations ---- */

/* A triangle with two morph targets. The first animation moves it to (1, 2, 3), turns it by 90 degrees about z,
 * doubles its size and, by the second target, enlarges it by another half; the second animation is unused. */
#define CHANNEL(sampler, path) "{'sampler': " sampler ", 'target': {'node': 0, 'path': '" path "'}}"
#define ANIMATED(channels, accessors)                                                                                 \
	"{" NODES                                                                                                     \
	", 'translation': [7, 7, 7], 'weights': [1, 1]}], 'animations': [{'name': 'Walk', 'channels': [" channels     \
	"], 'samplers': [{'input': 0, 'output': 3}, {'input': 0, 'output': 4, 'interpolation': 'STEP'}, "             \
	"{'input': 0, 'output': 5, 'interpolation': 'CUBICSPLINE'}, {'input': 0, 'output': 6}, {'input': 0}]}, "      \
	"{'channels': [{}], 'samplers': []}], 'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, 'targets': " \
	"[{'POSITION': 1}, {'POSITION': 2}]}]}], 'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, " \
	"'type': 'VEC3'}, {'bufferView': 0, 'byteOffset': 36, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}, "   \
	"{'bufferView': 0, 'byteOffset': 72, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}, " accessors "], "    \
	"'bufferViews': [{'buffer': 0, 'byteLength': 108}, {'buffer': 1, 'byteLength': 24}, {'buffer': 1, "           \
	"'byteOffset': 24, 'byteLength': 8}, {'buffer': 1, 'byteOffset': 32, 'byteLength': 36}, {'buffer': 1, "       \
	"'byteOffset': 68, 'byteLength': 16}], 'buffers': [$0, $1]}"
#define PLACE "{'bufferView': 1, 'componentType': 5126, 'count': 2, 'type': 'VEC3'}, "
#define TURN_OF(more) \
	"{'bufferView': 2, 'componentType': 5122, 'normalized': true, 'count': 1, 'type': 'VEC4'" more "}, "
#define SIZE "{'bufferView': 3, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}, "
#define WEIGHTS_OF(count) "{'bufferView': 4, 'componentType': 5126, 'count': " count ", 'type': 'SCALAR'}"
#define ALL_CHANNELS                \
	CHANNEL("0", "translation") \
	", " CHANNEL("1", "rotation") ", " CHANNEL("2", "scale") ", " CHANNEL("3", "weights")

static void animations_are_interpolated(void **state)
{
	(void)state;
	static const float up[9] = {0, 0, 1, 0, 0, 1, 0, 0, 1}, larger[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
	static const float places[6] = {1, 2, 3, 9, 9, 9}, sizes[9] = {5, 5, 5, 2, 2, 2, 5, 5, 5},
			   weights[4] = {0, 0.5f, 9, 9};
	static const int16_t turn[4] = {0, 0, 23170, 23170};
	begin_file();
	add_bytes(0, plain_triangle, sizeof plain_triangle);
	add_bytes(0, up, sizeof up);
	add_bytes(0, larger, sizeof larger);
	add_bytes(1, places, sizeof places);
	add_bytes(1, turn, sizeof turn);
	add_bytes(1, sizes, sizeof sizes);
	add_bytes(1, weights, sizeof weights);
	finish_json(ANIMATED(ALL_CHANNELS, PLACE TURN_OF("") SIZE WEIGHTS_OF("4")));
	struct world *w = world_from_files(4, 4, file.list);
	assert_corner(w, 0, 0, (vec3){1, 2, 3});
	assert_corner(w, 0, 1, (vec3){1, 5, 3});
	assert_corner(w, 0, 2, (vec3){-2, 2, 3});
	world_free(w);
	finish_json(ANIMATED(
		CHANNEL("0", "translation") ", {'sampler': 0, 'target': {'path': 'pointer'}}, " CHANNEL("3", "blur"),
		PLACE TURN_OF("") SIZE WEIGHTS_OF("4")));
	w = world_from_files(4, 4, file.list); /* properties that are not animated are those of the node */
	assert_triangle(w, 0, (vec3){1, 2, 4}, 2);
	world_free(w);
	finish_json(ANIMATED(
		CHANNEL("1", "rotation"),
		PLACE TURN_OF(", 'sparse': {'count': 1, 'indices': {'bufferView': 0, 'componentType': 5121}, 'values': "
			      "{'bufferView': 2}}") SIZE WEIGHTS_OF("4")));
	w = world_from_files(4, 4, file.list);
	assert_triangle(w, 0, (vec3){7, 7, 8}, 2);
	world_free(w);
	finish_json(ANIMATED(ALL_CHANNELS, PLACE TURN_OF("") SIZE WEIGHTS_OF("1")));
	expect_refused("accessors[6]: fewer values than the animation needs");
	finish_json(ANIMATED(CHANNEL("0", "rotation"), PLACE TURN_OF("") SIZE WEIGHTS_OF("4")));
	expect_refused("accessors[3]: of a type that animation cannot have");
	finish_json(ANIMATED(CHANNEL("9", "scale"), PLACE TURN_OF("") SIZE WEIGHTS_OF("4")));
	expect_refused("animations[0]: a channel without a sampler");
	static const float infinite[1] = {INFINITY};
	memcpy(file.bytes[1], infinite, sizeof infinite);
	finish_json(ANIMATED(ALL_CHANNELS, PLACE TURN_OF("") SIZE WEIGHTS_OF("4")));
	expect_refused("accessors[3]: a value that is not finite");
}

/* ---- buffers ---- */

static int open_count;
static struct asset_source inner_source;

static int open_counted(void *user, const char *name, struct asset *out, struct error *e)
{
	(void)user;
	open_count++;
	return inner_source.open(inner_source.user, name, out, e);
}

static void close_counted(void *user, struct asset *a)
{
	(void)user;
	inner_source.close(inner_source.user, a);
}

/* Makes twenty meshes with computed vertices, from two buffers in turn. */
static void make_meshes_of_alternating_buffers(const char *buffers)
{
	static const int8_t i8[12] = {0, 0, 0, 0, 127, 0, 0, 0, 0, 127, 0, 0};
	static const int8_t other[12] = {0, 0, 0, 0, 63, 0, 0, 0, 0, 63, 0, 0};
	char json[4096], meshes[2048] = "", nodes[512] = "", roots[256] = "";
	for (int i = 0; i < 20; i++) {
		const char *comma = i ? ", " : "";
		size_t m = strlen(meshes), n = strlen(nodes), r = strlen(roots);
		snprintf(meshes + m, sizeof meshes - m, "%s{'primitives': [{'attributes': {'POSITION': %d}}]}", comma,
			 i % 2);
		snprintf(nodes + n, sizeof nodes - n, "%s{'mesh': %d}", comma, i);
		snprintf(roots + r, sizeof roots - r, "%s%d", comma, i);
	}
	begin_file();
	add_bytes(0, i8, sizeof i8);
	add_bytes(1, other, sizeof other);
	snprintf(
		json, sizeof json,
		"{'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [%s]}], 'nodes': [%s], 'meshes': [%s], "
		"'accessors': [{'bufferView': 0, 'componentType': 5120, 'normalized': true, 'count': 3, 'type': 'VEC3'}, "
		"{'bufferView': 1, 'componentType': 5120, 'normalized': true, 'count': 3, 'type': 'VEC3'}], 'bufferViews': "
		"[{'buffer': 0, 'byteLength': 12, 'byteStride': 4}, {'buffer': 1, 'byteLength': 12, 'byteStride': 4}], "
		"'buffers': [%s]}",
		roots, nodes, meshes, buffers);
	finish_json(json);
}

/* Each buffer embedded in the file is decoded once. */
static void embedded_buffers_are_decoded_once(void **state)
{
	(void)state;
	struct scene s;
	struct error e;
	const struct asset_source assets = {.open = open_counted, .close = close_counted};
	make_meshes_of_alternating_buffers("$0, $1");
	inner_source = memory_assets(file.list);
	open_count = 0;
	if (scene_read(&s, &assets, "s.gltf", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	assert_int_equal(open_count, 3); /* the scene, and each buffer in it */
	scene_fini(&s);
}

/* Opens files that claim a size of 60 GB. */
static int open_large(void *user, const char *name, struct asset *out, struct error *e)
{
	int rc = open_counted(user, name, out, e);
	if (!rc && strstr(name, ".bin"))
		out->size = (size_t)60 << 30;
	return rc;
}

/* External files are read again when needed, but only a limited number of times. */
static void external_buffers_are_reread_a_limited_number_of_times(void **state)
{
	(void)state;
	struct scene s;
	struct error e;
	make_meshes_of_alternating_buffers("{'byteLength': 12, 'uri': 'a.bin'}, {'byteLength': 12, 'uri': 'b.bin'}");
	const struct memory_file list[] = {
		file.list[0], {"a.bin", file.bytes[0], file.size[0]}, {"b.bin", file.bytes[1], file.size[1]}, {0}};
	const struct asset_source assets = {.open = open_large, .close = close_counted};
	inner_source = memory_assets(list);
	open_count = 0;
	assert_int_equal(scene_read(&s, &assets, "s.gltf", render_plugins(), NULL, 0, &e), -E2BIG);
	assert_non_null(strstr(e.text, "its files are requested again and again; 300 GB were read so far"));
	assert_int_equal(open_count, 6);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(positions_of_each_type_are_read),
		cmocka_unit_test(sparse_accessors_replace_vertices),
		cmocka_unit_test(meshes_may_use_several_buffers),
		cmocka_unit_test(morph_targets_move_vertices),
		cmocka_unit_test(skins_move_vertices),
		cmocka_unit_test(instancing_extension_places_meshes),
		cmocka_unit_test(shared_meshes_are_stored_once),
		cmocka_unit_test(animations_are_interpolated),
		cmocka_unit_test(embedded_buffers_are_decoded_once),
		cmocka_unit_test(external_buffers_are_reread_a_limited_number_of_times),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
