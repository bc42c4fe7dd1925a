/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Each primitive of triangles becomes a shape of type "gltf" that names its buffer and the position of its numbers
 * there, or that contains its vertices if they have to be computed (gltf_pose.h). Points and lines have no area and are
 * left out, with a note. A large mesh of several nodes becomes a shapegroup, and each of its nodes an instance.
 * Failures: accessors of a type that the attribute cannot have, accessors that exceed their views.
 */
#include "worker/render/gltf/gltf_mesh.h"
#include "worker/render/gltf/gltf_buffer.h"
#include "worker/render/gltf/gltf_material.h"
#include "worker/render/gltf/gltf_node.h"
#include "worker/render/gltf/gltf_numbers.h"
#include "worker/render/gltf/gltf_pose.h"
#include "worker/render/gltf/gltf_texture.h"

#include <stdio.h>
#include <string.h>

enum { MODE_TRIANGLES = 4, MODE_STRIP = 5, MODE_FAN = 6 };

static const char *type_name(uint64_t component, uint64_t *size)
{
	*size = component == GLTF_UNSIGNED_BYTE ? 1 : component == GLTF_UNSIGNED_SHORT ? 2 : 4;
	return component == GLTF_UNSIGNED_BYTE	  ? "u8"
	       : component == GLTF_UNSIGNED_SHORT ? "u16"
	       : component == GLTF_UNSIGNED_INT	  ? "u32"
	       : component == GLTF_FLOAT	  ? "f32"
						  : NULL;
}

/* An array of numbers in a buffer. */
struct numbers {
	const char *name, *component;
	uint64_t first, stride, count, end;
};

/* The shape of a primitive, while it is made. */
struct primitive {
	struct gltf *g;
	const struct gltf_at *mesh;
	struct xml_element *shape;
	struct gltf_range buffer; /* holds all its attributes */
	struct numbers numbers[GLTF_SOURCES + 1];
	unsigned count;
	enum gltf_colours colours;
};

/* Adds the attribute `name` of the shape, read from that accessor. */
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
	if (gltf_follow(g, a, a->json, "bufferView", GLTF_BUFFER_VIEWS, &view) <= 0 ||
	    gltf_buffer_view(g, &view, &buffer, &first, &count) || g->failed)
		return;
	uint64_t offset = gltf_whole(g, a, a->json, "byteOffset", 0), wanted = gltf_whole(g, a, a->json, "count", 0),
		 stride = gltf_whole(g, &view, view.json, "byteStride", size * components);
	if (offset > count || stride < size * components || stride > count ||
	    (wanted > 0 &&
	     (count - offset < size * components || (wanted - 1) > (count - offset - size * components) / stride)))
		gltf_fail(g, a, EINVAL, "it exceeds bufferViews[%zu]", view.index);
	p->buffer = buffer;
	uint64_t begin = first + offset, end = wanted > 0 ? begin + (wanted - 1) * stride + size * components : begin;
	p->numbers[p->count++] = (struct numbers){name, component, begin, stride, wanted, end};
}

static enum gltf_colours colours_of(struct gltf *g, const struct gltf_at *a)
{
	return strcmp(gltf_text(g, a, a->json, "type", ""), "VEC4") == 0 ? GLTF_COLOURS_AND_ALPHA : GLTF_COLOURS;
}

/* Adds colours, which have three or four components; the fourth becomes a separate attribute of the shape. */
static void put_colours(struct primitive *p, const struct gltf_at *a)
{
	struct gltf *g = p->g;
	bool alpha = colours_of(g, a) == GLTF_COLOURS_AND_ALPHA;
	uint64_t size;
	put_accessor(p, a, "color", alpha ? "VEC4" : "VEC3", alpha ? 4 : 3);
	if (g->failed || !alpha || !type_name(gltf_whole(g, a, a->json, "componentType", 0), &size))
		return;
	struct numbers fourth = p->numbers[p->count - 1];
	fourth.name = "alpha";
	fourth.first += 3 * size;
	p->numbers[p->count++] = fourth;
}

/* Adds the part of the buffer that the shape reads, and where its arrays are in that part. The part begins at a
 * multiple of three bytes, a group of base64. */
static void put_numbers(struct primitive *p)
{
	uint64_t begin = UINT64_MAX, end = 0;
	for (unsigned i = 0; i < p->count; i++) {
		begin = p->numbers[i].first < begin ? p->numbers[i].first : begin;
		end = p->numbers[i].end > end ? p->numbers[i].end : end;
	}
	begin -= begin % 3;
	end = end > begin ? end : begin;
	const struct gltf_range part = gltf_range_part(&p->buffer, begin, end);
	gltf_put_range(p->g, p->shape, p->mesh, &part);
	for (unsigned i = 0; i < p->count; i++) {
		const struct numbers *n = &p->numbers[i];
		struct xml_element *el = gltf_element(p->g, p->shape, p->mesh, "string");
		gltf_attribute(p->g, el, "name", "%s", n->name);
		gltf_attribute(p->g, el, "value", "%llu %llu %llu %s", (unsigned long long)(n->first - begin),
			       (unsigned long long)n->stride, (unsigned long long)n->count, n->component);
	}
}

/* Extends the scene's bounding box by the bounds that an accessor of positions must state, for a camera that sees
 * everything. */
static void grow_box(struct gltf *g, const struct gltf_at *a, const mat4 *to_world)
{
	double bound[2][3] = {{0, 0, 0}, {0, 0, 0}};
	gltf_numbers(g, a, a->json, "min", bound[0], 3);
	gltf_numbers(g, a, a->json, "max", bound[1], 3);
	for (int i = 0; i < 6 && json_is_true(json_object_get(a->json, "normalized")); i++)
		bound[i / 3][i % 3] =
			gltf_normalized(bound[i / 3][i % 3], gltf_whole(g, a, a->json, "componentType", 0));
	for (int i = 0; i < 8; i++) {
		gltf_grow_box(
			g, mat4_point(to_world, (vec3){bound[i & 1][0], bound[i >> 1 & 1][1], bound[i >> 2 & 1][2]}));
	}
}

/* Uses the attributes as they are stored in a buffer. */
static void put_in_place(struct primitive *p, const struct gltf_primitive *from, const mat4 *to_world)
{
	static const struct {
		const char *name, *type;
		unsigned components;
	} forms[GLTF_SOURCES] = {{"position", "VEC3", 3},	{"normal", "VEC3", 3}, {"texcoord", "VEC2", 2},
				 {"texcoord_other", "VEC2", 2}, {NULL, NULL, 0},       {"index", "SCALAR", 1}};
	for (int i = 0; i < GLTF_SOURCES; i++) {
		const struct gltf_at *a = &from->sources[i];
		if (a->json && i == GLTF_COLOR)
			put_colours(p, a);
		else if (a->json)
			put_accessor(p, a, forms[i].name, forms[i].type, forms[i].components);
	}
	grow_box(p->g, &from->sources[GLTF_POSITION], to_world);
	if (!p->g->failed)
		put_numbers(p);
}

static void find_source(struct gltf *g, struct gltf_primitive *p, const json_t *o, const char *key,
			enum gltf_source which)
{
	if (gltf_follow(g, p->mesh, o, key, GLTF_ACCESSORS, &p->sources[which]) <= 0)
		p->sources[which].json = NULL;
}

static void find_sources(struct gltf *g, struct gltf_primitive *p, const json_t *attributes)
{
	struct gltf_at material;
	char texcoord[2][32];
	bool has = gltf_follow(g, p->mesh, p->json, "material", GLTF_MATERIALS, &material) > 0;
	struct gltf_sets sets = has ? gltf_texture_sets(g, &material) : (struct gltf_sets){{0, 0}, 0};
	for (int i = 0; i < 2; i++)
		snprintf(texcoord[i], sizeof texcoord[i], "TEXCOORD_%u", sets.set[i]);
	find_source(g, p, attributes, "POSITION", GLTF_POSITION);
	find_source(g, p, attributes, "NORMAL", GLTF_NORMAL);
	find_source(g, p, attributes, texcoord[0], GLTF_TEXCOORD);
	if (sets.count > 1)
		find_source(g, p, attributes, texcoord[1], GLTF_TEXCOORD_OTHER);
	find_source(g, p, attributes, "COLOR_0", GLTF_COLOR);
	find_source(g, p, p->json, "indices", GLTF_INDEX);
	if (!p->sources[GLTF_POSITION].json)
		gltf_fail(g, p->mesh, EINVAL, "a primitive has no POSITION");
}

/* Refuses a primitive compressed with Draco, unless its numbers are also in accessors, for readers that cannot
 * decompress it. */
static void check_draco(struct gltf *g, const struct gltf_primitive *p)
{
	if (!gltf_extension(g, p->mesh, p->json, "KHR_draco_mesh_compression"))
		return;
	for (int i = 0; i < GLTF_SOURCES; i++) {
		const json_t *a = p->sources[i].json;
		if (a && !json_object_get(a, "bufferView") && !json_object_get(a, "sparse"))
			gltf_fail(
				g, p->mesh, ENOTSUP,
				"compressed by Draco (KHR_draco_mesh_compression), which is not supported; export without "
				"compression (Blender: switch Compression off), or compress with EXT_meshopt_compression");
	}
}

static void put_primitive(struct gltf *g, struct xml_element *parent, const struct gltf_at *mesh,
			  const struct gltf_at *node, const json_t *primitive, mat4 to_world)
{
	uint64_t mode = gltf_whole(g, mesh, primitive, "mode", MODE_TRIANGLES);
	const json_t *attributes = gltf_object(g, mesh, primitive, "attributes");
	if (mode < MODE_TRIANGLES) {
		gltf_note(g, "points and lines have no area and are left out");
		return;
	}
	if (mode > MODE_FAN || !attributes) {
		gltf_fail(g, mesh, EINVAL, "a primitive without attributes, or of mode %llu", (unsigned long long)mode);
		return;
	}
	struct gltf_primitive from = {.mesh = mesh, .node = node, .json = primitive};
	struct primitive p = {.g = g, .mesh = mesh, .shape = gltf_plugin(g, parent, mesh, "shape", "gltf", NULL)};
	/* All of a .glb may be on one line, so messages name shapes by this id. */
	gltf_attribute(g, p.shape, "id", "shape %u, of meshes[%zu]", g->primitives, mesh->index);
	find_sources(g, &from, attributes);
	check_draco(g, &from);
	if (g->failed)
		return;
	if (gltf_is_posed(g, &from))
		gltf_put_pose(g, p.shape, &from, &to_world);
	else
		put_in_place(&p, &from, &to_world);
	if (g->failed)
		return;
	if (from.sources[GLTF_COLOR].json)
		p.colours = colours_of(g, &from.sources[GLTF_COLOR]);
	if (!from.sources[GLTF_NORMAL].json)
		gltf_put_bool(g, p.shape, mesh, "face_normals", true); /* as the format demands */
	if (mode != MODE_TRIANGLES)
		gltf_put_text(g, p.shape, mesh, "mode", mode == MODE_STRIP ? "strip" : "fan");
	gltf_put_matrix(g, p.shape, mesh, "to_world", &to_world);
	struct gltf_at material;
	if (gltf_follow(g, mesh, primitive, "material", GLTF_MATERIALS, &material) > 0)
		gltf_material(g, p.shape, &material, p.colours);
	else
		gltf_default_material(g, p.shape, p.colours);
}

static void put_primitives(struct gltf *g, struct xml_element *parent, const struct gltf_at *mesh,
			   const struct gltf_at *node, const mat4 *to_world)
{
	const json_t *primitives = json_object_get(mesh->json, "primitives");
	for (size_t i = 0; i < json_array_size(primitives) && !g->failed; i++) {
		const json_t *primitive = json_array_get(primitives, i);
		if (++g->primitives > GLTF_PRIMITIVES_MAX)
			gltf_fail(g, mesh, E2BIG, "more than %d primitives", GLTF_PRIMITIVES_MAX);
		else if (json_is_object(primitive))
			put_primitive(g, parent, mesh, node, primitive, *to_world);
		else
			gltf_fail(g, mesh, EINVAL, "its primitives are not objects");
		gltf_go_on(g);
	}
}

/* ---- meshes of several nodes */

/* Limit on the triangles that copies would add to the first; up to it, copies are faster than instances. */
static const double copied_most = 200000;

static bool shines(struct gltf *g, const struct gltf_at *mesh, const json_t *primitive)
{
	struct gltf_at material;
	double rgb[3];
	return gltf_follow(g, mesh, primitive, "material", GLTF_MATERIALS, &material) > 0 &&
	       gltf_material_shines(g, &material, rgb);
}

/* Returns whether the mesh becomes a shapegroup, which may hold neither emitters nor a mesh that each node deforms
 * differently. */
static bool is_shared(struct gltf *g, const struct gltf_at *mesh, const struct gltf_at *node)
{
	const json_t *primitives = json_object_get(mesh->json, "primitives");
	double corners = 0, uses = g->mesh_uses[mesh->index];
	if (uses < 2 || json_object_get(node->json, "skin") || json_object_get(node->json, "weights"))
		return false;
	for (size_t i = 0; i < json_array_size(primitives); i++) {
		const json_t *o = json_array_get(primitives, i), *index = json_object_get(o, "indices");
		if (!json_is_integer(index))
			index = json_object_get(json_object_get(o, "attributes"), "POSITION");
		corners += json_number_value(json_object_get(
			json_array_get(json_object_get(g->root, "accessors"), (size_t)json_integer_value(index)),
			"count"));
		if (shines(g, mesh, o))
			return false;
	}
	return corners / 3 * (uses - 1) > copied_most;
}

static void put_instance(struct gltf *g, const struct gltf_at *mesh, const struct gltf_at *node, const mat4 *to_world)
{
	static const char id[] = "group of meshes[%zu]";
	const json_t *primitives = json_object_get(mesh->json, "primitives");
	struct gltf_at a;
	if (!g->mesh_made[mesh->index]) {
		const mat4 identity = mat4_identity();
		struct xml_element *group = gltf_plugin(g, g->scene, mesh, "shape", "shapegroup", NULL);
		const vec3 low = g->low, high = g->high;
		gltf_attribute(g, group, "id", id, mesh->index);
		put_primitives(g, group, mesh, node, &identity);
		g->low = low;
		g->high = high;
		g->mesh_made[mesh->index] = true;
	}
	for (size_t i = 0; i < json_array_size(primitives); i++)
		if (gltf_follow(g, mesh, json_object_get(json_array_get(primitives, i), "attributes"), "POSITION",
				GLTF_ACCESSORS, &a) > 0)
			grow_box(g, &a, to_world);
	struct xml_element *instance = gltf_plugin(g, g->scene, mesh, "shape", "instance", NULL);
	gltf_attribute(g, gltf_element(g, instance, mesh, "ref"), "id", id, mesh->index);
	gltf_put_matrix(g, instance, mesh, "to_world", to_world);
}

void gltf_mesh(struct gltf *g, const struct gltf_at *mesh, const struct gltf_at *node, const mat4 *to_world)
{
	if (is_shared(g, mesh, node))
		put_instance(g, mesh, node, to_world);
	else
		put_primitives(g, g->scene, mesh, node, to_world);
}

/* ---- EXT_mesh_gpu_instancing */

/* Returns false if the attribute is missing or cannot be read. */
static bool read_instances(struct gltf *g, const struct gltf_at *node, const json_t *attributes, const char *name,
			   unsigned components, struct gltf_vectors *out)
{
	struct gltf_at a;
	out->x = NULL;
	return gltf_follow(g, node, attributes, name, GLTF_ACCESSORS, &a) > 0 &&
	       gltf_vectors_read(g, &a, name, components, out);
}

void gltf_mesh_instances(struct gltf *g, const struct gltf_at *mesh, const struct gltf_at *node,
			 const json_t *extension, const mat4 *to_world)
{
	const json_t *attributes = gltf_object(g, node, extension, "attributes");
	static const char *const parts[3] = {"TRANSLATION", "ROTATION", "SCALE"};
	struct gltf_vectors v[3] = {{.x = NULL}};
	uint64_t count = 0;
	bool any = false;
	for (int i = 0; i < 3; i++) {
		if (!read_instances(g, node, attributes, parts[i], i == 1 ? 4 : 3, &v[i]))
			continue;
		if (any && v[i].count != count)
			gltf_fail(g, node, EINVAL, "attributes of instances with different numbers of entries");
		count = v[i].count;
		any = true;
	}
	if (!count)
		gltf_fail(g, node, EINVAL, "EXT_mesh_gpu_instancing without instances");
	g->mesh_uses[mesh->index] += (double)count;
	for (uint64_t i = 0; i < count && !g->failed; i++) {
		bool valid;
		mat4 own = gltf_compose(v[0].x ? v[0].x + 3 * i : (const double[3]){0, 0, 0},
					v[1].x ? v[1].x + 4 * i : (const double[4]){0, 0, 0, 1},
					v[2].x ? v[2].x + 3 * i : (const double[3]){1, 1, 1}, &valid);
		own = mat4_mul(*to_world, own);
		if (valid)
			gltf_mesh(g, mesh, node, &own);
		else
			gltf_fail(g, node, EINVAL, "the rotation of instance %llu is not a quaternion",
				  (unsigned long long)i);
	}
	for (int i = 0; i < 3; i++)
		gltf_vectors_fini(&v[i]);
}
