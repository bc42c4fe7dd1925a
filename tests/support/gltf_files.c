/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes glTF files from one JSON text with a few placeholders and one buffer: with the buffer in a file beside it, in a
 * data URI, or in the binary form. Shares no code with the reader under test.
 */
#include "tests/support/gltf_files.h"
#include "worker/render/render.h"

#include "tests/support/mesh_files.h"

#include <assert.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <meshoptimizer.h>

/* BUFFER stands for the reference to the buffer's bytes. One entry per line, because messages state lines. */
static const char json_template[] =
	"{\"asset\": {\"version\": \"2.0\"}, \"scene\": 0, \"extensionsUsed\": [\"KHR_lights_punctual\"],\n"
	"\"extensions\": {\"KHR_lights_punctual\": {\"lights\": [\n"
	"{\"type\": \"point\", \"color\": [1, 0.5, 0.25], \"intensity\": 4}]}},\n"
	"\"scenes\": [{\"nodes\": [0, 1, 4, 5, 6]}],\n"
	"\"nodes\": [\n"
	"{\"mesh\": 0, \"translation\": [0, -1, 0], \"scale\": [4, 1, 4]},\n"
	"{\"translation\": [0, 1, 0], \"children\": [2, 3]},\n"
	"{\"mesh\": 1, \"translation\": [-1, -0.5, 0], \"rotation\": [0, 0.70710678118654757, 0, 0.70710678118654757]},\n"
	"{\"mesh\": 2, \"matrix\": [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 1, -1, 0.5, 1]},\n"
	"{\"mesh\": 3, \"translation\": [0, 3, 0], \"rotation\": [1, 0, 0, 0]},\n"
	"{\"camera\": 0, \"translation\": [0, 0.5, 6]},\n"
	"{\"translation\": [2, 2, 2], \"extensions\": {\"KHR_lights_punctual\": {\"light\": 0}}}],\n"
	"\"cameras\": [\n"
	"{\"type\": \"perspective\", \"perspective\": {\"yfov\": 0.75, \"aspectRatio\": 1, \"znear\": 0.01}}],\n"
	"\"meshes\": [\n"
	"{\"primitives\": [{\"mode\": 5, \"attributes\": {\"POSITION\": 9, \"TEXCOORD_0\": 11}, \"material\": 0}]},\n"
	"{\"primitives\": [{\"attributes\": {\"POSITION\": 0, \"NORMAL\": 1, \"TEXCOORD_0\": 2}, \"indices\": 3, "
	"\"material\": 1}]},\n"
	"{\"primitives\": [{\"attributes\": {\"POSITION\": 6, \"NORMAL\": 7, \"TEXCOORD_0\": 8}, \"indices\": 4, "
	"\"material\": 2}]},\n"
	"{\"primitives\": [{\"mode\": 6, \"attributes\": {\"POSITION\": 10, \"TEXCOORD_0\": 12}, \"material\": 3},\n"
	"{\"mode\": 0, \"attributes\": {\"POSITION\": 10}}]}],\n"
	"\"materials\": [\n"
	"{\"pbrMetallicRoughness\": {\"metallicFactor\": 0, \"baseColorFactor\": [0.8, 0.4, 0.2, 1]}},\n"
	"{\"pbrMetallicRoughness\": {\"baseColorFactor\": [0.5, 1, 0.25, 1], \"baseColorTexture\": {\"index\": 0},\n"
	"\"metallicFactor\": 0.5, \"metallicRoughnessTexture\": {\"index\": 0}}},\n"
	"{\"pbrMetallicRoughness\": {\"metallicFactor\": 0, \"roughnessFactor\": 0.5},\n"
	"\"extensions\": {\"KHR_materials_transmission\": {\"transmissionFactor\": 1},\n"
	"\"KHR_materials_ior\": {\"ior\": 1.75}}},\n"
	"{\"pbrMetallicRoughness\": {\"metallicFactor\": 0}, \"emissiveFactor\": [1, 0.5, 0.5],\n"
	"\"extensions\": {\"KHR_materials_emissive_strength\": {\"emissiveStrength\": 8}}}],\n"
	"\"textures\": [{\"source\": 0, \"sampler\": 0}],\n"
	"\"samplers\": [{\"wrapS\": 33071, \"wrapT\": 33648, \"magFilter\": 9728}],\n"
	"\"images\": [{\"uri\": \"rgb.hdr\"}],\n"
	"\"accessors\": [\n"
	"{\"bufferView\": 0, \"componentType\": 5126, \"count\": 6, \"type\": \"VEC3\", \"min\": [-1, -1, -1], \"max\": "
	"[1, 1, 1]},\n"
	"{\"bufferView\": 0, \"componentType\": 5126, \"count\": 6, \"type\": \"VEC3\"},\n"
	"{\"bufferView\": 1, \"componentType\": 5126, \"count\": 6, \"type\": \"VEC2\"},\n"
	"{\"bufferView\": 2, \"componentType\": 5123, \"count\": 24, \"type\": \"SCALAR\"},\n"
	"{\"bufferView\": 3, \"componentType\": 5125, \"count\": 24, \"type\": \"SCALAR\"},\n"
	"{\"bufferView\": 4, \"componentType\": 5121, \"count\": 24, \"type\": \"SCALAR\"},\n"
	"{\"bufferView\": 5, \"componentType\": 5126, \"count\": 6, \"type\": \"VEC3\", \"min\": [-1, -1, -1], \"max\": [1, 1, 1]},\n"
	"{\"bufferView\": 5, \"byteOffset\": 12, \"componentType\": 5126, \"count\": 6, \"type\": \"VEC3\"},\n"
	"{\"bufferView\": 5, \"byteOffset\": 24, \"componentType\": 5126, \"count\": 6, \"type\": \"VEC2\"},\n"
	"{\"bufferView\": 6, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\", \"min\": [-1, 0, -1], \"max\": [1, 0, 1]},\n"
	"{\"bufferView\": 7, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC3\", \"min\": [-1, 0, -1], \"max\": [1, 0, 1]},\n"
	"{\"bufferView\": 8, \"componentType\": 5123, \"normalized\": true, \"count\": 4, \"type\": \"VEC2\"},\n"
	"{\"bufferView\": 9, \"componentType\": 5121, \"normalized\": true, \"count\": 4, \"type\": \"VEC2\"}],\n"
	"\"bufferViews\": [\n"
	"{\"buffer\": 0, \"byteOffset\": 1, \"byteLength\": 72},\n"
	"{\"buffer\": 0, \"byteOffset\": 73, \"byteLength\": 48},\n"
	"{\"buffer\": 0, \"byteOffset\": 121, \"byteLength\": 48},\n"
	"{\"buffer\": 0, \"byteOffset\": 169, \"byteLength\": 96},\n"
	"{\"buffer\": 0, \"byteOffset\": 265, \"byteLength\": 24},\n"
	"{\"buffer\": 0, \"byteOffset\": 289, \"byteLength\": 192, \"byteStride\": 32},\n"
	"{\"buffer\": 0, \"byteOffset\": 481, \"byteLength\": 48},\n"
	"{\"buffer\": 0, \"byteOffset\": 529, \"byteLength\": 48},\n"
	"{\"buffer\": 0, \"byteOffset\": 577, \"byteLength\": 16},\n"
	"{\"buffer\": 0, \"byteOffset\": 593, \"byteLength\": 8}],\n"
	"\"buffers\": [\n"
	"{BUFFER \"byteLength\": 601}]}\n";

static void append_bytes(struct gltf_files *f, const void *bytes, size_t size)
{
	assert(f->buffer_size + size <= sizeof f->buffer);
	memcpy(f->buffer + f->buffer_size, bytes, size);
	f->buffer_size += size;
}

/* Little endian. */
static void append_bits(struct gltf_files *f, uint32_t bits, int size)
{
	for (int i = 0; i < size; i++)
		append_bytes(f, (const unsigned char[]){(unsigned char)(bits >> 8 * i)}, 1);
}

static void append_floats(struct gltf_files *f, const double *x, int count)
{
	for (int i = 0; i < count; i++) {
		float one = (float)x[i];
		uint32_t bits;
		memcpy(&bits, &one, sizeof bits);
		append_bits(f, bits, 4);
	}
}

void gltf_files_make(struct gltf_files *f)
{
	static const double strip[4][3] = {{-1, 0, -1}, {-1, 0, 1}, {1, 0, -1}, {1, 0, 1}},
			    fan[4][3] = {{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}};
	static const int strip_uv[4][2] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}},
			 fan_uv[4][2] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
	memset(f, 0, sizeof *f);
	memcpy(f->json, json_template, sizeof json_template);
	append_bits(f, 0x55, 1); /* so that nothing begins at a multiple of anything */
	append_floats(f, solid_position[0], 3 * SOLID_VERTICES);
	append_floats(f, solid_uv[0], 2 * SOLID_VERTICES);
	for (int size = 2; size > 0; size = size == 2 ? 4 : size == 4 ? 1 : 0)
		for (int i = 0; i < 3 * SOLID_TRIANGLES; i++)
			append_bits(f, solid_index[i / 3][i % 3], size);
	for (int i = 0; i < SOLID_VERTICES; i++) {
		append_floats(f, solid_position[i], 3);
		append_floats(f, solid_position[i], 3);
		append_floats(f, solid_uv[i], 2);
	}
	append_floats(f, strip[0], 12);
	append_floats(f, fan[0], 12);
	for (int i = 0; i < 8; i++)
		append_bits(f, strip_uv[i / 2][i % 2] ? 65535 : 0, 2);
	for (int i = 0; i < 8; i++)
		append_bits(f, fan_uv[i / 2][i % 2] ? 255 : 0, 1);
}

/* Compresses into `out` and returns the size. Two-byte indices are coded as a sequence, four-byte ones as triangles. */
static size_t compress_view(unsigned char *out, size_t capacity, const unsigned char *from, size_t count, size_t stride,
			    char mode)
{
	unsigned index[32] = {0};
	float vertices[64]; /* aligned */
	assert(count * stride <= sizeof vertices && (mode == 'A' || count <= 32));
	memcpy(vertices, from, count * stride);
	for (size_t i = 0; mode != 'A' && i < count; i++)
		memcpy(&index[i], from + i * stride, stride);
	meshopt_encodeVertexVersion(0);
	return mode == 'A'   ? meshopt_encodeVertexBuffer(out, capacity, vertices, count, stride)
	       : mode == 'T' ? meshopt_encodeIndexBuffer(out, capacity, index, count)
			     : meshopt_encodeIndexSequence(out, capacity, index, count);
}

void gltf_files_compress(struct gltf_files *f, const char *extension)
{
	static const struct {
		unsigned first, stride, count;
		const char *mode;
	} views[] = {{1, 12, 6, "ATTRIBUTES"},	 {73, 8, 6, "ATTRIBUTES"},   {121, 2, 24, "INDICES"},
		     {169, 4, 24, "TRIANGLES"},	 {289, 32, 6, "ATTRIBUTES"}, {481, 12, 4, "ATTRIBUTES"},
		     {529, 12, 4, "ATTRIBUTES"}, {577, 4, 4, "ATTRIBUTES"}};
	char from[256], to[512];
	assert(f->buffer_size == GLTF_FILES_PLAIN_BYTES);
	for (size_t i = 0; i < sizeof views / sizeof *views; i++) {
		unsigned char packed[512], *bytes = f->buffer + views[i].first;
		unsigned length = views[i].count * views[i].stride;
		size_t size =
			compress_view(packed, sizeof packed, bytes, views[i].count, views[i].stride, *views[i].mode);
		assert(size > 0);
		memset(bytes, 0xff, length);
		snprintf(from, sizeof from, "{\"buffer\": 0, \"byteOffset\": %u, \"byteLength\": %u", views[i].first,
			 length);
		snprintf(
			to, sizeof to,
			"{\"buffer\": 1, \"byteOffset\": 0, \"byteLength\": %u, \"extensions\": {\"%s\": {\"buffer\": 0, "
			"\"byteOffset\": %zu, \"byteLength\": %zu, \"byteStride\": %u, \"mode\": \"%s\", \"count\": %u}}",
			length, extension, f->buffer_size, size, views[i].stride, views[i].mode, views[i].count);
		gltf_files_replace(f, from, to);
		append_bytes(f, packed, size);
	}
	snprintf(from, sizeof from, "\"byteLength\": %d}]}", GLTF_FILES_PLAIN_BYTES);
	snprintf(to, sizeof to,
		 "\"byteLength\": %zu},\n{\"byteLength\": %d, \"extensions\": {\"%s\": {\"fallback\": true}}}]}",
		 f->buffer_size, GLTF_FILES_PLAIN_BYTES, extension);
	gltf_files_replace(f, from, to);
	snprintf(to, sizeof to, "\"extensionsRequired\": [\"%s\"], \"extensionsUsed\"", extension);
	gltf_files_replace(f, "\"extensionsUsed\"", to);
}

void gltf_files_replace(struct gltf_files *f, const char *from, const char *to)
{
	static char out[sizeof f->json];
	size_t used = 0, n = strlen(from), match_count = 0;
	for (const char *p = f->json; *p;) {
		bool is_match = strncmp(p, from, n) == 0;
		size_t size = is_match ? strlen(to) : 1;
		assert_true(used + size < sizeof out);
		memcpy(out + used, is_match ? to : p, size);
		used += size;
		p += is_match ? n : 1;
		match_count += is_match;
	}
	if (!match_count)
		fail_msg("there is no %s", from);
	out[used] = 0;
	memcpy(f->json, out, used + 1);
}

static void encode_base64(const unsigned char *bytes, size_t n, char *out)
{
	static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	for (size_t i = 0; i < n; i += 3) {
		uint32_t x = (uint32_t)bytes[i] << 16 | (uint32_t)(i + 1 < n ? bytes[i + 1] : 0) << 8 |
			     (uint32_t)(i + 2 < n ? bytes[i + 2] : 0);
		for (size_t k = 0; k < 4; k++)
			*out++ = i + k <= n ? letters[x >> (18 - 6 * k) & 63] : '=';
	}
	*out = 0;
}

static void store_word(unsigned char *to, size_t x)
{
	for (int i = 0; i < 4; i++)
		to[i] = (unsigned char)(x >> 8 * i);
}

/* Packs a header, the JSON padded with blanks, and the buffer padded with zeros. */
static void pack_binary(struct gltf_files *f)
{
	size_t json = (strlen(f->json) + 3) / 4 * 4, binary = (f->buffer_size + 3) / 4 * 4;
	unsigned char *p = f->file;
	assert_true(28 + json + binary <= sizeof f->file);
	memset(p, 0, 28 + json + binary);
	f->file_size = 28 + json + binary;
	memcpy(p, "glTF", 4);
	store_word(p + 4, 2);
	store_word(p + 8, f->file_size);
	store_word(p + 12, json);
	memcpy(p + 16, "JSON", 4);
	memset(p + 20, ' ', json);
	memcpy(p + 20, f->json, strlen(f->json));
	store_word(p + 20 + json, binary);
	memcpy(p + 24 + json, "BIN", 3);
	memcpy(p + 28 + json, f->buffer, f->buffer_size);
}

void gltf_files_pack(struct gltf_files *f, enum gltf_form form)
{
	static char json[sizeof f->json], uri[2 * sizeof f->buffer];
	int n = snprintf(uri, sizeof uri, "%s", form == GLTF_EXTERNAL ? "\"uri\": \"the%20mesh.bin\"," : "");
	if (form == GLTF_EMBEDDED) {
		n = snprintf(uri, sizeof uri, "\"uri\": \"data:application/octet-stream;base64,");
		encode_base64(f->buffer, f->buffer_size, uri + n);
		n = (int)strlen(uri);
		snprintf(uri + n, sizeof uri - (size_t)n, "\",");
	}
	memcpy(json, f->json, sizeof json);
	gltf_files_replace(f, "BUFFER", uri);
	if (form == GLTF_BINARY) {
		pack_binary(f);
	} else {
		f->file_size = strlen(f->json);
		memcpy(f->file, f->json, f->file_size);
	}
	memcpy(f->json, json, sizeof json);
	f->files[0] = (struct memory_file){form == GLTF_BINARY ? "s.glb" : "s.gltf", f->file, f->file_size};
	f->files[1] = (struct memory_file){"the mesh.bin", f->buffer, f->buffer_size};
}

const struct memory_file *gltf_files_make_changed(struct gltf_files *f, const char *from, const char *to)
{
	gltf_files_make(f);
	if (from)
		gltf_files_replace(f, from, to);
	gltf_files_pack(f, GLTF_EXTERNAL);
	return f->files;
}

int gltf_files_read(const struct memory_file *files, bool lenient, struct scene *s, struct error *e)
{
	struct asset_source assets = memory_assets(files);
	return (lenient ? scene_read_lenient : scene_read)(s, &assets, files[0].name, render_plugins(), NULL, 0, e);
}

static struct scene read_or_fail(const struct memory_file *files, bool lenient)
{
	struct scene s;
	struct error e;
	if (gltf_files_read(files, lenient, &s, &e))
		fail_msg("%s", e.text);
	return s;
}

struct scene gltf_files_read_changed(const char *from, const char *to, bool lenient)
{
	static struct gltf_files f;
	gltf_files_make_changed(&f, from, to);
	return read_or_fail(f.files, lenient);
}

struct scene gltf_files_read_packed(struct gltf_files *f, enum gltf_form form)
{
	gltf_files_pack(f, form);
	return read_or_fail(f->files, false);
}
