/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Each primitive of triangles becomes a shape of type "gltf" that names its buffer and the position of its numbers
 * there. Points and lines have no area and are left out, with a note. Failures: accessors of a type that the attribute
 * cannot have, accessors that exceed their views, sparse ones, attributes in different buffers.
 */
#include "worker/render/scene/gltf_mesh.h"
#include "worker/render/scene/gltf_buffer.h"
#include "worker/render/scene/gltf_material.h"
#include "worker/render/scene/gltf_tree.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { UNSIGNED_BYTE = 5121, UNSIGNED_SHORT = 5123, UNSIGNED_INT = 5125, FLOAT = 5126 };
enum { MODE_TRIANGLES = 4, MODE_STRIP = 5, MODE_FAN = 6 };

static const char *type_name(uint64_t component, uint64_t *size)
{
	*size = component == UNSIGNED_BYTE ? 1 : component == UNSIGNED_SHORT ? 2 : 4;
	return component == UNSIGNED_BYTE    ? "u8"
	       : component == UNSIGNED_SHORT ? "u16"
	       : component == UNSIGNED_INT   ? "u32"
	       : component == FLOAT	     ? "f32"
					     : NULL;
}

/* Numbers in a buffer. */
struct numbers {
	const char *name, *component;
	uint64_t first, stride, count, end;
};

/* The shape of a primitive while it is made. */
struct primitive {
	struct gltf *g;
	const struct gltf_at *mesh;
	struct xml_element *shape;
	struct gltf_range buffer; /* of all its attributes */
	struct numbers numbers[6];
	unsigned count;
	enum gltf_colours colours;
};

static bool same_buffer(const struct gltf_range *a, const struct gltf_range *b)
{
	return a->first == b->first && strcmp(a->file, b->file) == 0;
}

/* The attribute `name` of the shape, from that accessor. */
static void put_accessor(struct primitive *p, const struct gltf_at *a, const char *name, const char *type,
			 uint64_t components)
{
	struct gltf *g = p->g;
	struct gltf_at view;
	struct gltf_range buffer;
	uint64_t first, count, size;
	const char *component = type_name(gltf_whole(g, a, a->json, "componentType", 0), &size);
	if (!component || strcmp(gltf_text(g, a, a->json, "type", ""), type) != 0)
		gltf_fail(g, a, EINVAL, "of a type that %s cannot have", name);
	if (json_object_get(a->json, "sparse"))
		gltf_fail(g, a, ENOTSUP, "sparse accessors are not supported");
	if (gltf_follow(g, a, a->json, "bufferView", GLTF_BUFFER_VIEWS, &view) == 0)
		gltf_fail(g, a, ENOTSUP, "without a bufferView");
	if (g->failed || gltf_buffer_view(g, &view, &buffer, &first, &count))
		return;
	uint64_t offset = gltf_whole(g, a, a->json, "byteOffset", 0), wanted = gltf_whole(g, a, a->json, "count", 0),
		 stride = gltf_whole(g, &view, view.json, "byteStride", size * components);
	if (offset > count || stride < size * components || stride > count ||
	    (wanted > 0 &&
	     (count - offset < size * components || (wanted - 1) > (count - offset - size * components) / stride)))
		gltf_fail(g, a, EINVAL, "it exceeds bufferViews[%zu]", view.index);
	if (p->buffer.file && !same_buffer(&p->buffer, &buffer))
		gltf_fail(g, p->mesh, ENOTSUP, "attributes of a primitive in different buffers are not supported");
	p->buffer = buffer;
	uint64_t begin = first + offset, end = wanted > 0 ? begin + (wanted - 1) * stride + size * components : begin;
	p->numbers[p->count++] = (struct numbers){name, component, begin, stride, wanted, end};
}

/* Of three or four components; the fourth is another accessor of the shape. */
static void put_colours(struct primitive *p, const struct gltf_at *a)
{
	struct gltf *g = p->g;
	bool alpha = strcmp(gltf_text(g, a, a->json, "type", ""), "VEC4") == 0;
	put_accessor(p, a, "color", alpha ? "VEC4" : "VEC3", alpha ? 4 : 3);
	if (g->failed)
		return;
	p->colours = alpha ? GLTF_COLOURS_AND_ALPHA : GLTF_COLOURS;
	uint64_t size;
	if (!alpha || !type_name(gltf_whole(g, a, a->json, "componentType", 0), &size))
		return;
	struct numbers fourth = p->numbers[p->count - 1];
	fourth.name = "alpha";
	fourth.first += 3 * size;
	p->numbers[p->count++] = fourth;
}

/* The shape reads the part of the buffer that it needs; for base64 that starts at a group of three bytes. */
static void put_numbers(struct primitive *p)
{
	struct gltf_range part = p->buffer;
	uint64_t begin = UINT64_MAX, end = 0;
	for (unsigned i = 0; i < p->count; i++) {
		begin = p->numbers[i].first < begin ? p->numbers[i].first : begin;
		end = p->numbers[i].end > end ? p->numbers[i].end : end;
	}
	begin -= begin % 3;
	end = end > begin ? end : begin;
	part.first += part.base64 ? begin / 3 * 4 : begin;
	part.count = part.base64 ? ((end - begin) * 4 + 2) / 3 : end - begin;
	gltf_put_range(p->g, p->shape, p->mesh, &part);
	for (unsigned i = 0; i < p->count; i++) {
		const struct numbers *n = &p->numbers[i];
		struct xml_element *el = gltf_element(p->g, p->shape, p->mesh, "string");
		gltf_attribute(p->g, el, "name", "%s", n->name);
		gltf_attribute(p->g, el, "value", "%llu %llu %llu %s", (unsigned long long)(n->first - begin),
			       (unsigned long long)n->stride, (unsigned long long)n->count, n->component);
	}
}

/* The accessor's bounds, which positions must have, for a camera that sees everything. */
static void grow_box(struct gltf *g, const struct gltf_at *a, const mat4 *to_world)
{
	double bound[2][3] = {{0, 0, 0}, {0, 0, 0}};
	gltf_numbers(g, a, a->json, "min", bound[0], 3);
	gltf_numbers(g, a, a->json, "max", bound[1], 3);
	for (int i = 0; i < 8; i++) {
		vec3 p = mat4_point(to_world, (vec3){bound[i & 1][0], bound[i >> 1 & 1][1], bound[i >> 2 & 1][2]});
		g->low = (vec3){fmin(g->low.x, p.x), fmin(g->low.y, p.y), fmin(g->low.z, p.z)};
		g->high = (vec3){fmax(g->high.x, p.x), fmax(g->high.y, p.y), fmax(g->high.z, p.z)};
	}
}

static void put_attributes(struct primitive *p, const json_t *primitive, const json_t *attributes, const mat4 *to_world)
{
	struct gltf *g = p->g;
	struct gltf_at a;
	if (gltf_follow(g, p->mesh, attributes, "POSITION", GLTF_ACCESSORS, &a) <= 0) {
		gltf_fail(g, p->mesh, EINVAL, "a primitive has no POSITION");
		return;
	}
	put_accessor(p, &a, "position", "VEC3", 3);
	grow_box(g, &a, to_world);
	if (gltf_follow(g, p->mesh, attributes, "NORMAL", GLTF_ACCESSORS, &a) > 0)
		put_accessor(p, &a, "normal", "VEC3", 3);
	else
		gltf_put_bool(g, p->shape, p->mesh, "face_normals", true); /* as the format says */
	struct gltf_at material;
	char texcoord[32];
	bool has = gltf_follow(g, p->mesh, primitive, "material", GLTF_MATERIALS, &material) > 0;
	snprintf(texcoord, sizeof texcoord, "TEXCOORD_%u", has ? gltf_material_set(g, &material) : 0);
	if (gltf_follow(g, p->mesh, attributes, texcoord, GLTF_ACCESSORS, &a) > 0)
		put_accessor(p, &a, "texcoord", "VEC2", 2);
	if (gltf_follow(g, p->mesh, attributes, "COLOR_0", GLTF_ACCESSORS, &a) > 0)
		put_colours(p, &a);
	if (gltf_follow(g, p->mesh, primitive, "indices", GLTF_ACCESSORS, &a) > 0)
		put_accessor(p, &a, "index", "SCALAR", 1);
}

static void put_primitive(struct gltf *g, const struct gltf_at *mesh, const json_t *primitive, const mat4 *to_world)
{
	uint64_t mode = gltf_whole(g, mesh, primitive, "mode", MODE_TRIANGLES);
	const json_t *attributes = gltf_object(g, mesh, primitive, "attributes");
	if (gltf_extension(g, mesh, primitive, "KHR_draco_mesh_compression")) {
		gltf_fail(g, mesh, ENOTSUP, "KHR_draco_mesh_compression is not supported; export without compression");
		return;
	}
	if (mode < MODE_TRIANGLES) {
		gltf_note(g, "points and lines have no area and are left out");
		return;
	}
	if (mode > MODE_FAN || !attributes) {
		gltf_fail(g, mesh, EINVAL, "a primitive without attributes, or of mode %llu", (unsigned long long)mode);
		return;
	}
	struct primitive p = {.g = g, .mesh = mesh, .shape = gltf_plugin(g, g->scene, mesh, "shape", "gltf", NULL)};
	/* All of a .glb stands in one line: messages name shapes by this. */
	gltf_attribute(g, p.shape, "id", "shape %u, of meshes[%zu]", g->primitives, mesh->index);
	put_attributes(&p, primitive, attributes, to_world);
	if (g->failed)
		return;
	put_numbers(&p);
	if (mode != MODE_TRIANGLES)
		gltf_put_text(g, p.shape, mesh, "mode", mode == MODE_STRIP ? "strip" : "fan");
	gltf_put_matrix(g, p.shape, mesh, "to_world", to_world);
	if (json_array_size(json_object_get(primitive, "targets")))
		gltf_note(g, "its morph targets are ignored");
	struct gltf_at material;
	if (gltf_follow(g, mesh, primitive, "material", GLTF_MATERIALS, &material) > 0)
		gltf_material(g, p.shape, &material, p.colours);
	else
		gltf_default_material(g, p.shape, p.colours);
}

void gltf_mesh(struct gltf *g, const struct gltf_at *mesh, const mat4 *to_world)
{
	const json_t *primitives = json_object_get(mesh->json, "primitives");
	for (size_t i = 0; i < json_array_size(primitives) && !g->failed; i++) {
		const json_t *primitive = json_array_get(primitives, i);
		if (++g->primitives > GLTF_PRIMITIVES_MAX)
			gltf_fail(g, mesh, E2BIG, "more than %d primitives", GLTF_PRIMITIVES_MAX);
		else if (json_is_object(primitive))
			put_primitive(g, mesh, primitive, to_world);
		else
			gltf_fail(g, mesh, EINVAL, "its primitives are not objects");
	}
}
