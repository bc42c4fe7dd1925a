/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Compressed glTF: the meshes equal those of the original file, bit by bit; filters are undone by the formulas of the
 * specification; malformed data gives an error message, and damaged bytes have no other effect.
 */
#include "common/base/mem.h"
#include "tests/support/dice.h"
#include "tests/support/failing_memory.h"
#include "tests/support/gltf_files.h"
#include "tests/support/scene_parts.h"
#include "worker/render/shape/shape.h"

#include <math.h>
#include <meshoptimizer.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const extension_names[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};
static struct gltf_files changed_files;

/* ---- all shapes of a file ---- */

struct built {
	struct scene scene;
	bool has_scene;
	struct arena arena;
	struct shape_geometry shapes[64];
	const struct scene_node *nodes[64];
	unsigned count;
};

/* Reads the file and builds its shapes. Returns 0, or the error of the reader or of shape_build(). */
static int build(const struct memory_file *files, bool lenient, struct built *b, struct error *e)
{
	struct asset_source assets = memory_assets(files);
	uint64_t dropped;
	*b = (struct built){.arena = {.limit = 64 << 20}};
	int rc = gltf_files_read(files, lenient, &b->scene, e);
	b->has_scene = rc == 0;
	for (uint32_t i = 0; !rc && i < b->scene.object_count; i++) {
		if (b->scene.objects[i]->cls != PLUGIN_SHAPE)
			continue;
		assert_true(b->count < 64);
		b->nodes[b->count] = b->scene.objects[i];
		rc = shape_build(b->scene.objects[i], &assets, &b->arena, &b->shapes[b->count++], &dropped, e);
	}
	return rc;
}

static void release_built(struct built *b)
{
	if (b->has_scene)
		scene_fini(&b->scene);
	arena_fini(&b->arena);
}

static void build_valid(const struct memory_file *files, struct built *b)
{
	struct error e = {""};
	if (build(files, false, b, &e))
		fail_msg("%s", e.text);
	assert_true(b->count > 0);
}

/* The encoder may rotate the corners of a triangle. */
static bool is_same_triangle(const uint32_t a[3], const uint32_t b[3])
{
	for (int k = 0; k < 3; k++)
		if (a[0] == b[k] && a[1] == b[(k + 1) % 3] && a[2] == b[(k + 2) % 3])
			return true;
	return false;
}

static void assert_same_meshes(const struct built *a, const struct built *b)
{
	assert_int_equal(a->count, b->count);
	for (unsigned i = 0; i < a->count; i++) {
		const struct mesh *m = &a->shapes[i].mesh, *n = &b->shapes[i].mesh;
		size_t vertices = m->vertex_count;
		assert_int_equal(m->vertex_count, n->vertex_count);
		assert_int_equal(m->triangle_count, n->triangle_count);
		assert_memory_equal(m->position, n->position, vertices * sizeof *m->position);
		assert_memory_equal(m->uv, n->uv, vertices * sizeof *m->uv);
		assert_true(!m->normal == !n->normal);
		if (m->normal)
			assert_memory_equal(m->normal, n->normal, vertices * sizeof *m->normal);
		for (uint32_t t = 0; t < m->triangle_count; t++)
			assert_true(is_same_triangle(m->index[t], n->index[t]));
	}
}

static void test_compressed_file_gives_the_same_meshes(void **state)
{
	(void)state;
	struct built plain, packed;
	gltf_files_make(&changed_files);
	gltf_files_pack(&changed_files, GLTF_EXTERNAL);
	build_valid(changed_files.files, &plain);
	for (int form = 0; form < GLTF_FORMS; form++)
		for (int i = 0; i < 2; i++) {
			gltf_files_make(&changed_files);
			gltf_files_compress(&changed_files, extension_names[i]);
			gltf_files_pack(&changed_files, (enum gltf_form)form);
			build_valid(changed_files.files, &packed);
			assert_same_meshes(&plain, &packed);
			release_built(&packed);
		}
	release_built(&plain);
}

/* ---- filters ---- */

enum { VERTICES = 63, INSTANCES = 4, BUFFER_BYTES = 4096 };

static struct {
	unsigned char bytes[BUFFER_BYTES];
	size_t size;
	char views[2048];
	char json[BUFFER_BYTES];
} own;

static void append_view(const void *numbers, size_t count, size_t stride, const char *filter)
{
	size_t n = strlen(own.views),
	       size = meshopt_encodeVertexBuffer(own.bytes + own.size, BUFFER_BYTES - own.size, numbers, count, stride);
	assert_true(size > 0);
	snprintf(
		own.views + n, sizeof own.views - n,
		"%s{\"buffer\": 1, \"byteLength\": %zu, \"byteStride\": %zu, \"extensions\": {\"EXT_meshopt_compression\": "
		"{\"buffer\": 0, \"byteOffset\": %zu, \"byteLength\": %zu, \"byteStride\": %zu, \"count\": %zu, \"mode\": "
		"\"ATTRIBUTES\", \"filter\": \"%s\"}}}",
		n ? ", " : "", count * stride, stride, own.size, size, stride, count, filter);
	own.size += size;
}

/* The three filters as the specification defines them. */

static vec3 octahedral(double x, double y, double one)
{
	x /= one;
	y /= one;
	double z = 1 - fabs(x) - fabs(y), t = fmin(z, 0);
	return vec3_normalize((vec3){x - copysign(t, x), y - copysign(t, y), z});
}

static void quaternion(const int16_t in[4], double out[4])
{
	double one = in[3] | 3, x[3], w = 1;
	for (int k = 0; k < 3; k++) {
		x[k] = in[k] / one * sqrt(0.5);
		w -= x[k] * x[k];
	}
	for (int k = 0; k < 3; k++)
		out[((in[3] & 3) + 1 + k) % 4] = x[k];
	out[in[3] & 3] = sqrt(fmax(w, 0));
}

static double exponential(int32_t in)
{
	int32_t m = in & 0xffffff;
	return ldexp(m >= 0x800000 ? m - 0x1000000 : m, in >> 24);
}

static void rotate(const double q[4], double m[3][3])
{
	double x = q[0], y = q[1], z = q[2], w = q[3];
	const double turn[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
				   {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
				   {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
	memcpy(m, turn, sizeof turn);
}

/* The numbers to encode. */
static struct {
	int32_t position[VERTICES][3];
	int8_t normal[VERTICES][4];
	int16_t fine[VERTICES][4];
	int16_t turn[INSTANCES][4];
} encoded;

static void encode(bool fine)
{
	struct dice d = dice_for_test("filters of meshopt");
	float normal[VERTICES][4] = {{0}}, turn[INSTANCES][4];
	for (int i = 0; i < VERTICES; i++) {
		vec3 n = dice_direction(&d);
		for (int k = 0; k < 3; k++) {
			uint32_t exponent = 256 - 4 - dice_below(&d, 16), mantissa = dice_below(&d, 1 << 24);
			encoded.position[i][k] = (int32_t)(exponent << 24 | mantissa);
			normal[i][k] = (float)(k == 0 ? n.x : k == 1 ? n.y : n.z);
		}
	}
	for (int i = 0; i < INSTANCES; i++) {
		vec3 axis = vec3_scale(sin(0.4 + i), dice_direction(&d));
		const double q[4] = {axis.x, axis.y, axis.z, cos(0.4 + i)};
		for (int k = 0; k < 4; k++)
			turn[i][k] = (float)q[k];
	}
	meshopt_encodeVertexVersion(0);
	meshopt_encodeFilterOct(encoded.normal, VERTICES, 4, 8, normal[0]);
	meshopt_encodeFilterOct(encoded.fine, VERTICES, 8, 12, normal[0]);
	meshopt_encodeFilterQuat(encoded.turn, INSTANCES, 8, 12, turn[0]);
	own.size = 0;
	*own.views = 0;
	append_view(encoded.position, VERTICES, 12, "EXPONENTIAL");
	append_view(fine ? (const void *)encoded.fine : encoded.normal, VERTICES, fine ? 8 : 4, "OCTAHEDRAL");
	append_view(encoded.turn, INSTANCES, 8, "QUATERNION");
}

static void build_encoded(bool fine, struct built *b)
{
	encode(fine);
	int n = snprintf(
		own.json, sizeof own.json,
		"{\"asset\": {\"version\": \"2.0\"}, \"extensionsRequired\": [\"EXT_meshopt_compression\", "
		"\"KHR_mesh_quantization\"], \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0, \"extensions\": "
		"{\"EXT_mesh_gpu_instancing\": {\"attributes\": {\"ROTATION\": 2}}}}], \"meshes\": [{\"primitives\": "
		"[{\"attributes\": {\"POSITION\": 0, \"NORMAL\": 1}}]}], \"accessors\": [{\"bufferView\": 0, "
		"\"componentType\": 5126, \"type\": \"VEC3\", \"count\": %d}, {\"bufferView\": 1, \"componentType\": %d, "
		"\"normalized\": true, \"type\": \"VEC3\", \"count\": %d}, {\"bufferView\": 2, \"componentType\": 5122, "
		"\"normalized\": true, \"type\": \"VEC4\", \"count\": %d}], \"bufferViews\": [%s], \"buffers\": [{\"uri\": "
		"\"b\", \"byteLength\": %zu}, {\"byteLength\": 9999}]}",
		VERTICES, fine ? 5122 : 5120, VERTICES, INSTANCES, own.views, own.size);
	assert_true(n > 0 && (size_t)n < sizeof own.json);
	const struct memory_file files[] = {{"s.gltf", own.json, (size_t)n}, {"b", own.bytes, own.size}, {0}};
	build_valid(files, b);
	assert_int_equal(b->count, INSTANCES);
}

static void assert_direction(const double got[3], vec3 want, double error)
{
	vec3 off = vec3_sub(vec3_load(got), want);
	if (!(vec3_length(off) <= error))
		fail_msg("%g %g %g, not %g %g %g", got[0], got[1], got[2], want.x, want.y, want.z);
}

static void test_filters_are_decoded(void **state)
{
	(void)state;
	struct built b;
	for (int fine = 0; fine < 2; fine++) {
		build_encoded(fine, &b);
		for (int i = 0; i < INSTANCES; i++) {
			double q[4], turn[3][3];
			quaternion(encoded.turn[i], q);
			rotate(q, turn);
			mat4 m = node_transform(b.nodes[i], "to_world");
			for (int k = 0; k < 9; k++)
				assert_true(fabs(m.m[k / 3][k % 3] - turn[k / 3][k % 3]) < 4.0 / 32767);
			const struct mesh *mesh = &b.shapes[i].mesh;
			assert_int_equal(mesh->vertex_count, VERTICES);
			for (int v = 0; v < VERTICES; v++) {
				const int16_t *f = encoded.fine[v];
				const int8_t *c = encoded.normal[v];
				vec3 n = fine ? octahedral(f[0], f[1], f[2]) : octahedral(c[0], c[1], c[2]),
				     p = {exponential(encoded.position[v][0]), exponential(encoded.position[v][1]),
					  exponential(encoded.position[v][2])};
				/* Tolerance of one unit of the format in each component. */
				assert_direction(mesh->normal[v], vec3_unit_or_zero(mat4_vector(&m, n)),
						 2 * sqrt(3) / (fine ? 32767 : 127));
				assert_direction(mesh->position[v], mat4_point(&m, p), 1e-8);
			}
		}
		release_built(&b);
	}
}

/* Five colours as meshoptimizer 1.3 encodes them with 8, 6 and 12 bits, the last into components of two bytes. */
static void test_colour_filter_is_decoded(void **state)
{
	(void)state;
	enum { COLOURS = 5 };
	static const double colours[COLOURS][4] = {
		{1, 0, 0, 1}, {0.25, 0.5, 0.75, 0.5}, {0, 0, 0, 0}, {1, 1, 1, 1}, {0.1, 0.9, 0.3, 0.2}};
	static const int8_t eight[] = {64, 127,	 -63, -1, -128, -63, 0,	   -64, 0,  0,
				       0,  -128, -1,  0,  0,	-1,  -115, -25, 89, -103},
			    six[] = {16, 31, -15, 63, 32, -15, 0, 48, 0, 0, 0, 32, 63, 0, 0, 63, 35, -6, 22, 38};
	static const int16_t twelve[] = {1024, 2047, -1023, 4095, 2048, -1023, 0,    3072, 0,	 0,
					 0,    2048, 4095,  0,	  0,	4095,  2253, -409, 1433, 2457};
	static const struct {
		const void *numbers;
		int stride, bits;
	} cases[] = {{eight, 4, 8}, {six, 4, 6}, {twelve, 8, 12}};
	static const float position[3 * COLOURS] = {0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 2, 0, 0};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct built b;
		own.size = 0;
		*own.views = 0;
		meshopt_encodeVertexVersion(0);
		append_view(position, COLOURS, 12, "NONE");
		append_view(cases[i].numbers, COLOURS, (size_t)cases[i].stride, "COLOR");
		int n = snprintf(
			own.json, sizeof own.json,
			"{\"asset\": {\"version\": \"2.0\"}, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0}], \"meshes\": "
			"[{\"primitives\": [{\"mode\": 5, \"attributes\": {\"POSITION\": 0, \"COLOR_0\": 1}}]}], \"accessors\": "
			"[{\"bufferView\": 0, \"componentType\": 5126, \"type\": \"VEC3\", \"count\": 5}, {\"bufferView\": 1, "
			"\"componentType\": %d, \"normalized\": true, \"type\": \"VEC4\", \"count\": 5}], \"bufferViews\": [%s], "
			"\"buffers\": [{\"uri\": \"b\", \"byteLength\": %zu}, {\"byteLength\": 9999}]}",
			cases[i].stride == 4 ? 5121 : 5123, own.views, own.size);
		assert_true(n > 0 && (size_t)n < sizeof own.json);
		const struct memory_file files[] = {{"s.gltf", own.json, (size_t)n}, {"b", own.bytes, own.size}, {0}};
		build_valid(files, &b);
		const struct mesh *m = &b.shapes[0].mesh;
		assert_int_equal(m->attribute_count, 2);
		assert_string_equal(m->attributes[0].name, "vertex_color");
		for (int k = 0; k < 4 * COLOURS; k++) {
			double got = (double)(k % 4 < 3 ? m->attributes[0].value[k / 4 * 3 + k % 4]
							: m->attributes[1].value[k / 4]),
			       step = 1.0 / ((1 << cases[i].bits) - 1);
			if (!(fabs(got - colours[k / 4][k % 4]) < (k % 4 < 3 ? 2 : 3) * step))
				fail_msg("%d bits, number %d: %g", cases[i].bits, k, got);
		}
		release_built(&b);
	}
}

/* ---- one change each ---- */

static void expect_refused(const struct memory_file *files, const char *text)
{
	struct built b;
	struct error e = {"no error at all"};
	int rc = build(files, false, &b, &e);
	release_built(&b);
	if (rc >= 0 || !strstr(e.text, text))
		fail_msg("gave %d: %s\n not: %s", rc, e.text, text);
}

#define WIDE "\"byteStride\": 12, \"mode\": \"ATTRIBUTES\", \"count\": 6"
static const struct {
	const char *from[2], *to[2], *text;
} malformed[] = {
	{{"\"ATTRIBUTES\""},
	 {"\"POINTS\""},
	 "bufferViews[6]: compressed by meshopt's mode \"POINTS\", which is not supp"},
	{{WIDE}, {WIDE ", \"filter\": \"GREY\""}, "meshopt's filter \"GREY\", which is not supported"},
	{{WIDE}, {WIDE ", \"filter\": \"COLOR\""}, "meshopt's ATTRIBUTES cannot have"},
	{{WIDE},
	 {WIDE ", \"filter\": \"QUATERNION\""},
	 "a byteStride, filter or count that meshopt's ATTRIBUTES cannot have"},
	{{WIDE}, {WIDE ", \"filter\": \"OCTAHEDRAL\""}, "meshopt's ATTRIBUTES cannot have"},
	{{"\"INDICES\""}, {"\"INDICES\", \"filter\": \"EXPONENTIAL\""}, "meshopt's INDICES cannot have"},
	{{"\"byteStride\": 12"}, {"\"byteStride\": 10"}, "meshopt's ATTRIBUTES cannot have"},
	{{"\"byteStride\": 12"}, {"\"byteStride\": 0"}, "meshopt's ATTRIBUTES cannot have"},
	{{"\"byteStride\": 12"}, {"\"byteStride\": 260"}, "meshopt's ATTRIBUTES cannot have"},
	{{"\"byteStride\": 12,"}, {""}, "meshopt's ATTRIBUTES cannot have"},
	{{"\"byteStride\": 2,"}, {"\"byteStride\": 1,"}, "meshopt's INDICES cannot have"},
	{{"\"TRIANGLES\", \"count\": 24"}, {"\"TRIANGLES\", \"count\": 23"}, "meshopt's TRIANGLES cannot have"},
	{{"\"count\": 6}"}, {"\"count\": 7}"}, "its byteLength is not count times byteStride"},
	{{WIDE, "\"byteLength\": 72"},
	 {"\"byteStride\": 12, \"mode\": \"ATTRIBUTES\", \"count\": 1099511627776", "\"byteLength\": 13194139533312"},
	 "compressed bytes cannot stand for 13194139533312"},
	{{"_compression\": {\"buffer\": 0"}, {"_compression\": {\"buffer\": 7"}, "there is no buffers[7]"},
	{{"_compression\": {\"buffer\": 0,"}, {"_compression\": {"}, "bufferViews[6]: it has no buffer"},
	{{"\"byteOffset\": 601, "}, {"\"byteOffset\": 5000, "}, "it exceeds buffers[0]"},
	{{"{\"uri\": \"rgb.hdr\"}"},
	 {"{\"bufferView\": 0}"},
	 "bufferViews[0]: it is compressed, which only views of accessors may be"},
	{{"\"count\": 6, \"type\": \"VEC2\""}, {"\"count\": 9, \"type\": \"VEC2\""}, "it exceeds bufferViews[1]"},
};

static void test_malformed_compression_is_refused(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof malformed / sizeof *malformed; i++) {
		gltf_files_make(&changed_files);
		gltf_files_compress(&changed_files, extension_names[0]);
		for (int k = 0; k < 2 && malformed[i].from[k]; k++)
			gltf_files_replace(&changed_files, malformed[i].from[k], malformed[i].to[k]);
		gltf_files_pack(&changed_files, GLTF_EXTERNAL);
		expect_refused(changed_files.files, malformed[i].text);
	}
}

/* The first of the compressed bytes tells the coding. */
static void test_unknown_codings_are_refused(void **state)
{
	(void)state;
	static const struct {
		unsigned char first;
		const char *text;
	} cases[] = {{0xaf, "compressed by version 15 of meshopt's ATTRIBUTES"},
		     {0x55, "bufferViews[0]: its compressed bytes are damaged"}};
	for (int i = 0; i < 2; i++) {
		gltf_files_make(&changed_files);
		gltf_files_compress(&changed_files, extension_names[1]);
		changed_files.buffer[GLTF_FILES_PLAIN_BYTES] = cases[i].first;
		gltf_files_pack(&changed_files, GLTF_EXTERNAL);
		expect_refused(changed_files.files, cases[i].text);
	}
}

/* Half a megabyte of compressed data would expand to more than one file may have, although memory would suffice. */
static void test_expanded_size_is_limited(void **state)
{
	(void)state;
	enum { SIZE = 600000, COUNT = 50000000 };
	char *bytes = mem_alloc(SIZE, 1);
	assert_non_null(bytes);
	int n = snprintf(
		own.json, sizeof own.json,
		"{\"asset\": {\"version\": \"2.0\"}, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0}], "
		"\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], \"accessors\": [{\"bufferView\": "
		"0, \"componentType\": 5126, \"type\": \"VEC3\", \"count\": 3}], \"bufferViews\": [{\"byteLength\": %d, "
		"\"extensions\": {\"EXT_meshopt_compression\": {\"buffer\": 0, \"byteLength\": %d, \"count\": %d, "
		"\"byteStride\": 12, \"mode\": \"ATTRIBUTES\"}}}], \"buffers\": [{\"uri\": \"b\", \"byteLength\": %d}]}",
		12 * COUNT, SIZE, COUNT, SIZE);
	assert_true(n > 0 && (size_t)n < sizeof own.json);
	const struct memory_file files[] = {{"s.gltf", own.json, (size_t)n}, {"b", bytes, SIZE}, {0}};
	expect_refused(files, "bufferViews[0]: the compressed views have more than 512 MB");
	mem_free(bytes);
}

/* Damaged bytes of the file and of its buffer give a scene or an error message. */
static void test_damaged_files_are_read_or_refused(void **state)
{
	(void)state;
	struct dice d = dice_for_test("damaged meshopt");
	unsigned sound = 0;
	for (int i = 0; i < 2000; i++) {
		struct built b;
		struct error e = {""};
		gltf_files_make(&changed_files);
		gltf_files_compress(&changed_files, extension_names[i / 2 % 2]);
		gltf_files_pack(&changed_files, GLTF_EXTERNAL);
		if (i % 2)
			changed_files.file[dice_below(&d, (uint32_t)changed_files.file_size)] =
				(unsigned char)dice_below(&d, 256);
		else
			changed_files
				.buffer[GLTF_FILES_PLAIN_BYTES +
					dice_below(&d, (uint32_t)changed_files.buffer_size - GLTF_FILES_PLAIN_BYTES)] =
				(unsigned char)dice_below(&d, 256);
		int rc = build(changed_files.files, i % 3, &b, &e);
		assert_true(rc == 0 || (rc < 0 && *e.text));
		sound += rc == 0;
		release_built(&b);
	}
	assert_true(sound > 100 && sound < 1900);
}

/* Each allocation of the reader fails once: each failure gives an error message, and the last run a scene. */
static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	struct scene s;
	struct error e;
	long n = 0;
	int rc = -ENOMEM;
	gltf_files_make(&changed_files);
	gltf_files_compress(&changed_files, extension_names[0]);
	gltf_files_pack(&changed_files, GLTF_EMBEDDED);
	for (; rc; n++) {
		mem_fail_after(n);
		rc = gltf_files_read(changed_files.files, false, &s, &e);
		mem_fail_after(-1);
		assert_true(rc == 0 || (rc == -ENOMEM && strstr(e.text, "memory")));
	}
	assert_true(n > 20);
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_compressed_file_gives_the_same_meshes),
		cmocka_unit_test(test_filters_are_decoded),
		cmocka_unit_test(test_colour_filter_is_decoded),
		cmocka_unit_test(test_malformed_compression_is_refused),
		cmocka_unit_test(test_unknown_codings_are_refused),
		cmocka_unit_test(test_expanded_size_is_limited),
		cmocka_unit_test(test_damaged_files_are_read_or_refused),
		cmocka_unit_test(test_failed_allocations_are_reported),
	};
	return cmocka_run_group_tests_name("gltf_meshopt", tests, NULL, NULL);
}
