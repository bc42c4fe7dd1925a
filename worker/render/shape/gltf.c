/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A primitive of a glTF 2.0 mesh. `position`, `normal`, `texcoord` and `index` each describe numbers in a buffer as
 * "first stride count type": the offset of the first element and the distance between elements, in bytes, the number of
 * elements, and the type f32, u8, u16 or u32 (texture coordinates in u8 and u16 stand for 0 to 1). The reader of glTF
 * scenes (worker/render/gltf/gltf.h) writes these descriptions; they are checked again here.
 *
 * Creation fails if numbers lie outside the buffer, if an index is out of range, or if there are more vertices or
 * triangles than a mesh may have.
 */
#include "worker/render/scene/asset_part.h"
#include "worker/render/text/number.h"
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"

#include "common/base/bytes.h"
#include "common/base/liveness.h"

#include <string.h>

enum number_type { F32, U8, U16, U32, NUMBER_TYPES };
static const struct {
	const char *name;
	size_t size;
} number_types[NUMBER_TYPES] = {{"f32", 4}, {"u8", 1}, {"u16", 2}, {"u32", 4}};

/* An array of vectors in a buffer. */
struct accessor {
	const unsigned char *data;
	uint64_t stride, count;
	enum number_type type;
};

/* Reads the description of an array. Returns 0, 1 if the property is absent, or a negative error code. */
static int read_accessor(struct accessor *a, const struct scene_node *n, const char *name, unsigned components,
			 unsigned allowed_types, const struct asset_range *buffer, struct error *e)
{
	const char *text = node_string(n, name, NULL);
	if (!text)
		return 1;
	int64_t x[3] = {0};
	const char *p = text, *end = text + strlen(text);
	for (int i = 0; i < 3 && p; i++) {
		p = number_scan_int(p, end, &x[i]);
		p = p && *p == ' ' && x[i] >= 0 ? p + 1 : NULL;
	}
	unsigned t = 0;
	while (p && t < NUMBER_TYPES && strcmp(p, number_types[t].name) != 0)
		t++;
	if (!p || t == NUMBER_TYPES || !(allowed_types >> t & 1))
		return node_error(
			n, e, EINVAL,
			"`%s` has to be \"first stride count type\": offsets in bytes, a number of elements, and %s",
			name, allowed_types == 1u << F32 ? "f32" : "a type");
	uint64_t size = number_types[t].size * components, first = (uint64_t)x[0], stride = (uint64_t)x[1],
		 count = (uint64_t)x[2];
	if (count > UINT32_MAX || (stride < size && count > 1) || stride > buffer->size || first > buffer->size ||
	    (count > 0 && (buffer->size - first < size || (count - 1) * stride > buffer->size - first - size)))
		return node_error(n, e, EINVAL, "`%s` exceeds its buffer of %zu bytes", name, buffer->size);
	*a = (struct accessor){buffer->bytes + first, stride, count, (enum number_type)t};
	return 0;
}

static uint32_t component_bits(const struct accessor *a, uint64_t i, unsigned component)
{
	const unsigned char *p = a->data + i * a->stride + number_types[a->type].size * component;
	return (uint32_t)get_bytes(p, (int)number_types[a->type].size);
}

static double read_number(const struct accessor *a, uint64_t i, unsigned component)
{
	uint32_t bits = component_bits(a, i, component);
	float x;
	if (a->type != F32)
		return bits / (a->type == U8 ? 255.0 : 65535.0);
	memcpy(&x, &bits, sizeof x);
	return (double)x;
}

enum primitive_mode { TRIANGLES, STRIP, FAN };

static uint64_t mode_triangle_count(enum primitive_mode mode, uint64_t corners)
{
	return mode == TRIANGLES ? corners / 3 : corners > 2 ? corners - 2 : 0;
}

/* Returns the position of corner k of triangle t among the indices; in strips, every second triangle is reversed. */
static uint64_t mode_corner(enum primitive_mode mode, uint64_t t, unsigned k)
{
	if (mode == TRIANGLES)
		return 3 * t + k;
	if (mode == FAN)
		return k == 0 ? 0 : t + k;
	return t + (k > 0 && t % 2 ? 3 - k : k);
}

static int fill_mesh(struct mesh *m, const struct scene_node *n, const struct accessor *position,
		     const struct accessor *normal, const struct accessor *texcoord, const struct accessor *index,
		     enum primitive_mode mode, struct error *e)
{
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		for (unsigned k = 0; k < 3; k++)
			m->position[i][k] = read_number(position, i, k);
		if (!vec3_is_finite(vec3_load(m->position[i])))
			return node_error(n, e, EINVAL, "vertex %u is not finite", i);
		if (m->normal)
			mesh_set_normal(m, i,
					(vec3){read_number(normal, i, 0), read_number(normal, i, 1),
					       read_number(normal, i, 2)});
		for (unsigned k = 0; m->uv && k < 2; k++)
			m->uv[i][k] = read_number(texcoord, i, k);
		if (m->uv && !(isfinite(m->uv[i][0]) && isfinite(m->uv[i][1])))
			return node_error(n, e, EINVAL, "the texture coordinates of vertex %u are not finite", i);
		if (i % 65536 == 0)
			liveness_tick();
	}
	for (uint32_t t = 0; t < m->triangle_count; t++)
		for (unsigned k = 0; k < 3; k++) {
			uint64_t c = mode_corner(mode, t, k);
			uint64_t v = index ? component_bits(index, c, 0) : c;
			if (v >= m->vertex_count)
				return node_error(n, e, EINVAL, "index %llu is out of range; there are %u vertices",
						  (unsigned long long)v, m->vertex_count);
			m->index[t][k] = (uint32_t)v;
		}
	return 0;
}

/* Adds the attribute that the property `name` describes, if that is present. */
static int add_attribute(struct mesh *m, const struct scene_node *n, const char *name, const char *attribute,
			 unsigned components, const struct asset_range *buffer, struct arena *arena, struct error *e)
{
	struct accessor source;
	int rc = read_accessor(&source, n, name, components, 1u << F32 | 1u << U8 | 1u << U16, buffer, e);
	if (rc)
		return rc < 0 ? rc : 0;
	if (source.count != m->vertex_count)
		return node_error(n, e, EINVAL, "`%s` has another number of entries than `position`", name);
	struct attribute *a = mesh_add_attribute(m, attribute, false, components, 3, arena);
	if (!a)
		return node_error(n, e, ENOMEM, "out of memory");
	for (uint32_t i = 0; i < m->vertex_count; i++)
		for (unsigned k = 0; k < components; k++)
			mesh_set_attribute(a, i, k, read_number(&source, i, k));
	return 0;
}

static int make_mesh(const struct scene_node *n, const struct asset_range *buffer, struct arena *arena, struct mesh *m,
		     struct error *e)
{
	struct accessor position, normal, texcoord, index;
	const unsigned float_types = 1u << F32, normalized_types = float_types | 1u << U8 | 1u << U16,
		       integer_types = 1u << U8 | 1u << U16 | 1u << U32;
	int rc = read_accessor(&position, n, "position", 3, float_types, buffer, e);
	if (rc > 0)
		return node_error(n, e, EINVAL, "needs a `position`");
	int no_normal = rc < 0 ? rc : read_accessor(&normal, n, "normal", 3, float_types, buffer, e);
	int no_uv = no_normal < 0 ? no_normal : read_accessor(&texcoord, n, "texcoord", 2, normalized_types, buffer, e);
	int no_index = no_uv < 0 ? no_uv : read_accessor(&index, n, "index", 1, integer_types, buffer, e);
	if (no_index < 0)
		return no_index;
	if ((!no_normal && normal.count != position.count) || (!no_uv && texcoord.count != position.count))
		return node_error(n, e, EINVAL, "the numbers of positions, normals and texture coordinates differ");
	const char *mode_name = node_string(n, "mode", "triangles");
	enum primitive_mode mode = strcmp(mode_name, "strip") == 0 ? STRIP
				   : strcmp(mode_name, "fan") == 0 ? FAN
								   : TRIANGLES;
	uint64_t corners = no_index ? position.count : index.count, triangles = mode_triangle_count(mode, corners);
	if (mode == TRIANGLES && corners % 3)
		return node_error(n, e, EINVAL, "%llu corners are not a whole number of triangles",
				  (unsigned long long)corners);
	if (triangles > MESH_TRIANGLES_MAX || position.count > 3ull * MESH_TRIANGLES_MAX)
		return node_error(n, e, E2BIG, "more than %d triangles", MESH_TRIANGLES_MAX);
	if (!mesh_alloc(m, (uint32_t)position.count, (uint32_t)triangles, !no_normal, !no_uv, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	rc = fill_mesh(m, n, &position, &normal, &texcoord, no_index ? NULL : &index, mode, e);
	if (!rc)
		rc = add_attribute(m, n, "color", "vertex_color", 3, buffer, arena, e);
	if (!rc)
		rc = add_attribute(m, n, "alpha", "vertex_alpha", 1, buffer, arena, e);
	return rc ? rc : add_attribute(m, n, "texcoord_other", "vertex_texcoord", 2, buffer, arena, e);
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct asset_range buffer;
	int rc = asset_part_open(&buffer, n, assets, e);
	if (rc)
		return rc;
	rc = make_mesh(n, &buffer, arena, &out->mesh, e);
	asset_range_close(&buffer, assets);
	return rc;
}

SHAPE_OPS(gltf, {"filename", UNDERSTOOD(VALUE_STRING)}, ASSET_PART_PARAMS,
	  {"embedded", UNDERSTOOD(VALUE_STRING)}, /* the buffer itself in base64, instead of a file */
	  {"position", UNDERSTOOD(VALUE_STRING)}, {"normal", UNDERSTOOD(VALUE_STRING)},
	  {"texcoord", UNDERSTOOD(VALUE_STRING)},
	  {"texcoord_other", UNDERSTOOD(VALUE_STRING)}, /* the attribute vertex_texcoord */
	  {"index", UNDERSTOOD(VALUE_STRING)}, {"mode", VALUE_STRING, PARAM_UNDERSTOOD, 0, 0, "triangles|strip|fan"},
	  {"color", UNDERSTOOD(VALUE_STRING)}, /* the attribute vertex_color */
	  {"alpha", UNDERSTOOD(VALUE_STRING)}, /* the attribute vertex_alpha */
	  {"face_normals", UNDERSTOOD(VALUE_BOOL)}, SHAPE_PARAMS);
