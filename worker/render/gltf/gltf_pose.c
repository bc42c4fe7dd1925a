/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads all attributes as numbers, adds the morph targets by their weights (glTF 2.0, section 3.7.2.2), moves the
 * vertices by the skin's joints (3.7.3), and puts floats and indices into the shape as base64 (asset/asset_range.h).
 *
 * Failures: attributes of different lengths, joints that do not exist, more than EMBEDDED_BYTES_MAX bytes in one file.
 */
#include "worker/render/gltf/gltf_pose.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/asset/asset_range.h"
#include "worker/render/gltf/gltf_buffer.h"
#include "worker/render/gltf/gltf_meshopt.h"
#include "worker/render/gltf/gltf_node.h"
#include "worker/render/gltf/gltf_numbers.h"

#include <stdio.h>
#include <string.h>

enum { JOINT_SETS_MAX = 8 };
#define EMBEDDED_BYTES_MAX (UINT64_C(512) << 20)

/* ---- which primitives */

static bool can_read_in_place(struct gltf *g, const struct gltf_entry *a, enum gltf_source source,
			      struct gltf_range *buffer)
{
	struct gltf_entry view;
	struct gltf_range view_buffer;
	uint64_t first, count, type = gltf_integer(g, a, a->json, "componentType", 0);
	bool is_short_integer = type == GLTF_UNSIGNED_BYTE || type == GLTF_UNSIGNED_SHORT;
	if ((source == GLTF_POSITION || source == GLTF_NORMAL) && type != GLTF_FLOAT)
		return false;
	if ((source == GLTF_TEXCOORD || source == GLTF_COLOR) && type != GLTF_FLOAT &&
	    !(is_short_integer && json_is_true(json_object_get(a->json, "normalized"))))
		return false;
	if (json_object_get(a->json, "sparse") || !json_object_get(a->json, "bufferView"))
		return false;
	if (gltf_resolve(g, a, a->json, "bufferView", GLTF_BUFFER_VIEWS, &view) <= 0)
		return true; /* an error, which has been reported */
	if (gltf_meshopt_extension(g, &view))
		return false;
	if (gltf_locate_buffer_view(g, &view, &view_buffer, &first, &count))
		return true;
	if (!buffer->file)
		*buffer = view_buffer;
	return strcmp(view_buffer.file, buffer->file) == 0 && view_buffer.first_byte == buffer->first_byte;
}

/* Returns the weights of the morph targets, of the node or else of the mesh; NULL if no target has an effect. */
static const json_t *active_weights(const struct gltf_primitive *p)
{
	const json_t *weights = json_object_get(p->node->json, "weights");
	if (!json_is_array(weights))
		weights = json_object_get(p->mesh->json, "weights");
	for (size_t i = 0; i < json_array_size(weights); i++)
		if (json_number_value(json_array_get(weights, i)) != 0)
			return json_array_size(json_object_get(p->json, "targets")) ? weights : NULL;
	return NULL;
}

static bool has_skin(const struct gltf_primitive *p)
{
	return json_object_get(p->node->json, "skin") &&
	       json_object_get(json_object_get(p->json, "attributes"), "JOINTS_0");
}

bool gltf_has_computed_vertices(struct gltf *g, const struct gltf_primitive *p)
{
	struct gltf_range buffer = {.file = NULL};
	if (active_weights(p) || has_skin(p))
		return true;
	for (int i = 0; i < GLTF_SOURCES; i++)
		if (p->sources[i].json && !can_read_in_place(g, &p->sources[i], (enum gltf_source)i, &buffer))
			return true;
	return false;
}

/* ---- morph targets */

static void add_morph_target(struct gltf *g, const struct gltf_primitive *p, const json_t *target,
			     const char *attribute, double weight, struct gltf_vectors *sum)
{
	struct gltf_entry a;
	struct gltf_vectors v;
	if (!sum->values || gltf_resolve(g, p->mesh, target, attribute, GLTF_ACCESSORS, &a) <= 0 ||
	    !gltf_vectors_read(g, &a, attribute, 3, &v))
		return;
	if (v.count != sum->count)
		gltf_fail(g, &a, EINVAL, "a morph target has another number of vertices than its primitive");
	for (uint64_t i = 0; !g->error_code && i < 3 * v.count; i++)
		sum->values[i] += weight * v.values[i];
	gltf_vectors_fini(&v);
}

static void apply_morph_targets(struct gltf *g, const struct gltf_primitive *p, struct gltf_vectors *v)
{
	const json_t *weights = active_weights(p), *targets = json_object_get(p->json, "targets");
	for (size_t i = 0; weights && i < json_array_size(targets) && !g->error_code; i++) {
		double weight = json_number_value(json_array_get(weights, i));
		if (weight == 0)
			continue;
		add_morph_target(g, p, json_array_get(targets, i), "POSITION", weight, &v[GLTF_POSITION]);
		add_morph_target(g, p, json_array_get(targets, i), "NORMAL", weight, &v[GLTF_NORMAL]);
	}
}

/* ---- skins */

/* Returns for each joint the matrix from the mesh's space to the world; allocated with mem_alloc(). */
static mat4 *joint_matrices(struct gltf *g, const struct gltf_entry *skin, size_t *count)
{
	const json_t *joints = json_object_get(skin->json, "joints");
	struct gltf_vectors inverse = {.values = NULL};
	struct gltf_entry a;
	*count = json_array_size(joints);
	mat4 *out = *count ? mem_alloc(*count, sizeof *out) : NULL;
	if (!out) {
		gltf_fail(g, skin, *count ? ENOMEM : EINVAL, *count ? "out of memory" : "it has no joints");
		return NULL;
	}
	if (gltf_resolve(g, skin, skin->json, "inverseBindMatrices", GLTF_ACCESSORS, &a) > 0 &&
	    gltf_vectors_read(g, &a, "inverseBindMatrices", 16, &inverse) && inverse.count < *count)
		gltf_fail(g, &a, EINVAL, "fewer matrices than skins[%zu] has joints", skin->index);
	for (size_t i = 0; i < *count && !g->error_code; i++) {
		const json_t *joint = json_array_get(joints, i);
		if (!json_is_integer(joint) || json_integer_value(joint) < 0)
			gltf_fail(g, skin, EINVAL, "its joints are not indices");
		else if (gltf_node_to_world(g, (uint64_t)json_integer_value(joint), &out[i]) && inverse.values)
			out[i] = mat4_mul(out[i], gltf_matrix_from_columns(inverse.values + 16 * i));
	}
	gltf_vectors_fini(&inverse);
	return out;
}

/* Adds weight * matrix of the joints of one set (JOINTS_n, WEIGHTS_n) to each vertex's matrix. Returns false if
 * there is no such set, or after a failure. */
static bool add_joints(struct gltf *g, const struct gltf_primitive *p, unsigned set, const mat4 *matrices, size_t count,
		       mat4 *sums, double *weights, uint64_t vertices)
{
	const json_t *attributes = json_object_get(p->json, "attributes");
	struct gltf_vectors joint = {.values = NULL}, weight = {.values = NULL};
	struct gltf_entry a[2];
	char name[2][16];
	snprintf(name[0], sizeof name[0], "JOINTS_%u", set);
	snprintf(name[1], sizeof name[1], "WEIGHTS_%u", set);
	if (gltf_resolve(g, p->mesh, attributes, name[0], GLTF_ACCESSORS, &a[0]) <= 0 ||
	    gltf_resolve(g, p->mesh, attributes, name[1], GLTF_ACCESSORS, &a[1]) <= 0)
		return false;
	if (gltf_vectors_read(g, &a[0], name[0], 4, &joint) && gltf_vectors_read(g, &a[1], name[1], 4, &weight) &&
	    (joint.count != vertices || weight.count != vertices))
		gltf_fail(g, p->mesh, EINVAL, "%s and %s have another number of entries than POSITION", name[0],
			  name[1]);
	for (uint64_t i = 0; i < 4 * vertices && !g->error_code; i++) {
		if (weight.values[i] == 0)
			continue;
		if (!(joint.values[i] >= 0 && joint.values[i] < (double)count)) {
			gltf_fail(g, &a[0], EINVAL, "vertex %llu has a joint that its skin does not have",
				  (unsigned long long)i / 4);
			break;
		}
		const mat4 *m = &matrices[(size_t)joint.values[i]];
		for (int k = 0; k < 12; k++)
			sums[i / 4].m[k / 4][k % 4] += weight.values[i] * m->m[k / 4][k % 4];
		weights[i / 4] += weight.values[i];
		if (i % 65536 == 0)
			liveness_tick();
	}
	gltf_vectors_fini(&joint);
	gltf_vectors_fini(&weight);
	return !g->error_code;
}

static vec3 load_vec3(const double *x)
{
	return (vec3){x[0], x[1], x[2]};
}

static void store_vec3(double *x, vec3 v)
{
	x[0] = v.x;
	x[1] = v.y;
	x[2] = v.z;
}

static void move_by_joints(struct gltf_vectors *v, mat4 *sums, const double *weights)
{
	for (uint64_t i = 0; i < v[GLTF_POSITION].count; i++) {
		mat4 m = sums[i], inverse;
		for (int k = 0; k < 12 && weights[i] != 0; k++)
			m.m[k / 4][k % 4] /= weights[i];
		if (weights[i] == 0)
			m = mat4_identity();
		m.m[3][3] = 1;
		double *p = v[GLTF_POSITION].values + 3 * i;
		store_vec3(p, mat4_point(&m, load_vec3(p)));
		if (!v[GLTF_NORMAL].values)
			continue;
		double *n = v[GLTF_NORMAL].values + 3 * i;
		store_vec3(n, mat4_invert(m, &inverse) ? vec3_normalize(mat4_normal(&inverse, load_vec3(n)))
						       : (vec3){0, 0, 0});
	}
}

/* Moves the vertices by the skin. Its joints place them in the world; the node's own transform is ignored. */
static void apply_skin(struct gltf *g, const struct gltf_primitive *p, struct gltf_vectors *v)
{
	struct gltf_entry skin;
	size_t count = 0;
	uint64_t vertices = v[GLTF_POSITION].count;
	if (gltf_resolve(g, p->node, p->node->json, "skin", GLTF_SKINS, &skin) <= 0)
		return;
	mat4 *matrices = joint_matrices(g, &skin, &count), *sums = mem_alloc(vertices + 1, sizeof *sums);
	double *weights = mem_alloc(vertices + 1, sizeof *weights);
	if (!sums || !weights)
		gltf_fail(g, p->mesh, ENOMEM, "out of memory");
	for (unsigned set = 0; !g->error_code && set < JOINT_SETS_MAX; set++)
		if (!add_joints(g, p, set, matrices, count, sums, weights, vertices))
			break;
	if (!g->error_code)
		move_by_joints(v, sums, weights);
	mem_free(matrices);
	mem_free(sums);
	mem_free(weights);
}

/* ---- the shape's bytes */

static const char *const source_names[GLTF_SOURCES] = {"position",	 "normal", "texcoord",
						       "texcoord_other", "color",  "index"};

static size_t vectors_size(const struct gltf_vectors *v)
{
	return (size_t)v->count * v->component_count * 4;
}

/* Stores floats, or indices as 32-bit integers. */
static void pack_vectors(const struct gltf_vectors *v, bool as_indices, unsigned char *out)
{
	for (uint64_t i = 0; i < v->count * v->component_count; i++) {
		float f = (float)v->values[i];
		uint32_t bits = as_indices ? (uint32_t)v->values[i] : 0;
		memcpy(out + 4 * i, as_indices ? (const void *)&bits : &f, 4);
	}
}

static void put_accessor(struct gltf *g, struct xml_element *shape, const struct gltf_primitive *p, const char *name,
			 uint64_t first, const struct gltf_vectors *v, bool as_indices)
{
	struct xml_element *el = gltf_add_element(g, shape, p->mesh, "string");
	gltf_add_attribute(g, el, "name", "%s", name);
	gltf_add_attribute(g, el, "value", "%llu %u %llu %s", (unsigned long long)first, 4 * v->component_count,
			   (unsigned long long)v->count, as_indices ? "u32" : "f32");
}

static void put_bytes(struct gltf *g, struct xml_element *shape, const struct gltf_primitive *p,
		      const struct gltf_vectors *v)
{
	size_t size = 0, offset = 0;
	for (int i = 0; i < GLTF_SOURCES; i++)
		size += v[i].values ? vectors_size(&v[i]) : 0;
	if (size > EMBEDDED_BYTES_MAX || (g->embedded_bytes += size) > EMBEDDED_BYTES_MAX) {
		gltf_fail(g, p->mesh, E2BIG, "more than %llu MB of vertices are compressed, quantized, sparse or moved",
			  (unsigned long long)EMBEDDED_BYTES_MAX >> 20);
		return;
	}
	unsigned char *bytes = mem_alloc(size + 1, 1);
	char *text = bytes ? arena_alloc(g->arena, ASSET_RANGE_BASE64_SIZE(size), 1) : NULL;
	if (!text) {
		mem_free(bytes);
		gltf_fail(g, p->mesh, ENOMEM, "out of memory");
		return;
	}
	for (int i = 0; i < GLTF_SOURCES; i++) {
		if (!v[i].values)
			continue;
		pack_vectors(&v[i], i == GLTF_INDEX, bytes + offset);
		put_accessor(g, shape, p, source_names[i], offset, &v[i], i == GLTF_INDEX);
		if (i == GLTF_COLOR && v[i].component_count == 4)
			put_accessor(g, shape, p, "alpha", offset + 12, &v[i], false);
		offset += vectors_size(&v[i]);
	}
	asset_range_encode_base64(bytes, size, text);
	mem_free(bytes);
	gltf_put_string(g, shape, p->mesh, "embedded", text);
}

static void extend_bounds(struct gltf *g, const struct gltf_vectors *v, const mat4 *to_world)
{
	for (uint64_t i = 0; i < v->count; i++) {
		gltf_extend_bounds(g, mat4_point(to_world, load_vec3(v->values + 3 * i)));
	}
}

void gltf_put_computed_vertices(struct gltf *g, struct xml_element *shape, const struct gltf_primitive *p,
				mat4 *to_world)
{
	static const unsigned components[GLTF_SOURCES] = {3, 3, 2, 2, 0, 1};
	struct gltf_vectors v[GLTF_SOURCES] = {{.values = NULL}};
	for (int i = 0; i < GLTF_SOURCES && !g->error_code; i++)
		if (p->sources[i].json && gltf_vectors_read(g, &p->sources[i], source_names[i], components[i], &v[i]) &&
		    i != GLTF_INDEX && v[i].count != v[GLTF_POSITION].count)
			gltf_fail(g, &p->sources[i], EINVAL, "another number of entries than POSITION has");
	uint64_t type = gltf_integer(g, p->mesh, p->sources[GLTF_INDEX].json, "componentType", GLTF_UNSIGNED_INT);
	if (!g->error_code && type != GLTF_UNSIGNED_BYTE && type != GLTF_UNSIGNED_SHORT && type != GLTF_UNSIGNED_INT)
		gltf_fail(g, &p->sources[GLTF_INDEX], EINVAL, "of a type that index cannot have");
	if (!g->error_code && v[GLTF_COLOR].values && v[GLTF_COLOR].component_count < 3)
		gltf_fail(g, &p->sources[GLTF_COLOR], EINVAL, "of a type that color cannot have");
	if (!g->error_code)
		apply_morph_targets(g, p, v);
	if (!g->error_code && has_skin(p)) {
		apply_skin(g, p, v);
		*to_world = mat4_identity();
	}
	if (!g->error_code) {
		extend_bounds(g, &v[GLTF_POSITION], to_world);
		put_bytes(g, shape, p, v);
	}
	for (int i = 0; i < GLTF_SOURCES; i++)
		gltf_vectors_fini(&v[i]);
}
