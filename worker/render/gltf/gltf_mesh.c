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

static const char *component_type_name(uint64_t component, uint64_t *size)
{
	*size = component == GLTF_UNSIGNED_BYTE ? 1 : component == GLTF_UNSIGNED_SHORT ? 2 : 4;
	return component == GLTF_UNSIGNED_BYTE	  ? "u8"
	       : component == GLTF_UNSIGNED_SHORT ? "u16"
	       : component == GLTF_UNSIGNED_INT	  ? "u32"
	       : component == GLTF_FLOAT	  ? "f32"
						  : NULL;
}

/* An array of numbers in a buffer. */
struct number_array {
	const char *name, *component_type;
	uint64_t first_byte, stride, count, end_byte;
};

/* The shape of a primitive, while it is made. */
struct primitive_shape {
	struct gltf *g;
	const struct gltf_entry *mesh;
	struct xml_element *shape;
	struct gltf_range buffer; /* holds all its attributes */
	struct number_array arrays[GLTF_SOURCES + 1];
	unsigned array_count;
	enum gltf_vertex_colours colours;
};

/* Adds the attribute `name` of the shape, read from that accessor. */
static void put_accessor(struct primitive_shape *p, const struct gltf_entry *a, const char *name, const char *type,
			 uint64_t components)
{
	struct gltf *g = p->g;
	struct gltf_entry view;
	struct gltf_range buffer;
	uint64_t view_first, view_size, size;
	const char *component = component_type_name(gltf_integer(g, a, a->json, "componentType", 0), &size);
	if (!component || strcmp(gltf_string(g, a, a->json, "type", ""), type) != 0)
		gltf_fail(g, a, EINVAL, "of a type that %s cannot have", name);
	if (gltf_resolve(g, a, a->json, "bufferView", GLTF_BUFFER_VIEWS, &view) <= 0 ||
	    gltf_locate_buffer_view(g, &view, &buffer, &view_first, &view_size) || g->error_code)
		return;
	uint64_t offset = gltf_integer(g, a, a->json, "byteOffset", 0),
		 element_count = gltf_integer(g, a, a->json, "count", 0),
		 stride = gltf_integer(g, &view, view.json, "byteStride", size * components);
	if (offset > view_size || stride < size * components || stride > view_size ||
	    (element_count > 0 && (view_size - offset < size * components ||
				   (element_count - 1) > (view_size - offset - size * components) / stride)))
		gltf_fail(g, a, EINVAL, "it exceeds bufferViews[%zu]", view.index);
	p->buffer = buffer;
	uint64_t begin = view_first + offset,
		 end = element_count > 0 ? begin + (element_count - 1) * stride + size * components : begin;
	p->arrays[p->array_count++] = (struct number_array){name, component, begin, stride, element_count, end};
}

static enum gltf_vertex_colours accessor_colours(struct gltf *g, const struct gltf_entry *a)
{
	return strcmp(gltf_string(g, a, a->json, "type", ""), "VEC4") == 0 ? GLTF_COLOURS_AND_ALPHA : GLTF_COLOURS;
}

/* Adds colours, which have three or four components; the fourth becomes a separate attribute of the shape. */
static void put_colours(struct primitive_shape *p, const struct gltf_entry *a)
{
	struct gltf *g = p->g;
	bool alpha = accessor_colours(g, a) == GLTF_COLOURS_AND_ALPHA;
	uint64_t size;
	put_accessor(p, a, "color", alpha ? "VEC4" : "VEC3", alpha ? 4 : 3);
	if (g->error_code || !alpha || !component_type_name(gltf_integer(g, a, a->json, "componentType", 0), &size))
		return;
	struct number_array fourth = p->arrays[p->array_count - 1];
	fourth.name = "alpha";
	fourth.first_byte += 3 * size;
	p->arrays[p->array_count++] = fourth;
}

/* Adds the part of the buffer that the shape reads, and where its arrays are in that part. The part begins at a
 * multiple of three bytes, a group of base64. */
static void put_numbers(struct primitive_shape *p)
{
	uint64_t begin = UINT64_MAX, end = 0;
	for (unsigned i = 0; i < p->array_count; i++) {
		begin = p->arrays[i].first_byte < begin ? p->arrays[i].first_byte : begin;
		end = p->arrays[i].end_byte > end ? p->arrays[i].end_byte : end;
	}
	begin -= begin % 3;
	end = end > begin ? end : begin;
	const struct gltf_range part = gltf_range_slice(&p->buffer, begin, end);
	gltf_put_range(p->g, p->shape, p->mesh, &part);
	for (unsigned i = 0; i < p->array_count; i++) {
		const struct number_array *n = &p->arrays[i];
		struct xml_element *el = gltf_add_element(p->g, p->shape, p->mesh, "string");
		gltf_add_attribute(p->g, el, "name", "%s", n->name);
		gltf_add_attribute(p->g, el, "value", "%llu %llu %llu %s", (unsigned long long)(n->first_byte - begin),
				   (unsigned long long)n->stride, (unsigned long long)n->count, n->component_type);
	}
}

/* Extends the scene's bounding box by the bounds that an accessor of positions must state, for a camera that sees
 * everything. */
static void extend_bounds_by_accessor(struct gltf *g, const struct gltf_entry *a, const mat4 *to_world)
{
	double bound[2][3] = {{0, 0, 0}, {0, 0, 0}};
	gltf_numbers(g, a, a->json, "min", bound[0], 3);
	gltf_numbers(g, a, a->json, "max", bound[1], 3);
	for (int i = 0; i < 6 && json_is_true(json_object_get(a->json, "normalized")); i++)
		bound[i / 3][i % 3] =
			gltf_normalized_value(bound[i / 3][i % 3], gltf_integer(g, a, a->json, "componentType", 0));
	for (int i = 0; i < 8; i++) {
		gltf_extend_bounds(
			g, mat4_point(to_world, (vec3){bound[i & 1][0], bound[i >> 1 & 1][1], bound[i >> 2 & 1][2]}));
	}
}

/* Uses the attributes as they are stored in a buffer. */
static void put_stored_attributes(struct primitive_shape *p, const struct gltf_primitive *source, const mat4 *to_world)
{
	static const struct {
		const char *name, *type;
		unsigned components;
	} layouts[GLTF_SOURCES] = {{"position", "VEC3", 3},	  {"normal", "VEC3", 3}, {"texcoord", "VEC2", 2},
				   {"texcoord_other", "VEC2", 2}, {NULL, NULL, 0},	 {"index", "SCALAR", 1}};
	for (int i = 0; i < GLTF_SOURCES; i++) {
		const struct gltf_entry *a = &source->sources[i];
		if (a->json && i == GLTF_COLOR)
			put_colours(p, a);
		else if (a->json)
			put_accessor(p, a, layouts[i].name, layouts[i].type, layouts[i].components);
	}
	extend_bounds_by_accessor(p->g, &source->sources[GLTF_POSITION], to_world);
	if (!p->g->error_code)
		put_numbers(p);
}

static void find_source(struct gltf *g, struct gltf_primitive *p, const json_t *o, const char *key,
			enum gltf_source source)
{
	if (gltf_resolve(g, p->mesh, o, key, GLTF_ACCESSORS, &p->sources[source]) <= 0)
		p->sources[source].json = NULL;
}

static void find_sources(struct gltf *g, struct gltf_primitive *p, const json_t *attributes)
{
	struct gltf_entry material;
	char texcoord[2][32];
	bool has_material = gltf_resolve(g, p->mesh, p->json, "material", GLTF_MATERIALS, &material) > 0;
	struct gltf_texcoord_sets sets =
		has_material ? gltf_material_texcoord_sets(g, &material) : (struct gltf_texcoord_sets){{0, 0}, 0};
	for (int i = 0; i < 2; i++)
		snprintf(texcoord[i], sizeof texcoord[i], "TEXCOORD_%u", sets.sets[i]);
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

static void put_primitive(struct gltf *g, struct xml_element *parent, const struct gltf_entry *mesh,
			  const struct gltf_entry *node, const json_t *primitive, mat4 to_world)
{
	uint64_t mode = gltf_integer(g, mesh, primitive, "mode", MODE_TRIANGLES);
	const json_t *attributes = gltf_object(g, mesh, primitive, "attributes");
	if (mode < MODE_TRIANGLES) {
		gltf_note(g, "points and lines have no area and are left out");
		return;
	}
	if (mode > MODE_FAN || !attributes) {
		gltf_fail(g, mesh, EINVAL, "a primitive without attributes, or of mode %llu", (unsigned long long)mode);
		return;
	}
	struct gltf_primitive source = {.mesh = mesh, .node = node, .json = primitive};
	struct primitive_shape p = {
		.g = g, .mesh = mesh, .shape = gltf_add_plugin(g, parent, mesh, "shape", "gltf", NULL)};
	/* All of a .glb may be on one line, so messages name shapes by this id. */
	gltf_add_attribute(g, p.shape, "id", "shape %u, of meshes[%zu]", g->primitive_count, mesh->index);
	find_sources(g, &source, attributes);
	check_draco(g, &source);
	if (g->error_code)
		return;
	if (gltf_has_computed_vertices(g, &source))
		gltf_put_computed_vertices(g, p.shape, &source, &to_world);
	else
		put_stored_attributes(&p, &source, &to_world);
	if (g->error_code)
		return;
	if (source.sources[GLTF_COLOR].json)
		p.colours = accessor_colours(g, &source.sources[GLTF_COLOR]);
	if (!source.sources[GLTF_NORMAL].json)
		gltf_put_bool(g, p.shape, mesh, "face_normals", true); /* as the format demands */
	if (mode != MODE_TRIANGLES)
		gltf_put_string(g, p.shape, mesh, "mode", mode == MODE_STRIP ? "strip" : "fan");
	gltf_put_matrix(g, p.shape, mesh, "to_world", &to_world);
	struct gltf_entry material;
	if (gltf_resolve(g, mesh, primitive, "material", GLTF_MATERIALS, &material) > 0)
		gltf_add_material(g, p.shape, &material, p.colours);
	else
		gltf_add_default_material(g, p.shape, p.colours);
}

static void put_primitives(struct gltf *g, struct xml_element *parent, const struct gltf_entry *mesh,
			   const struct gltf_entry *node, const mat4 *to_world)
{
	const json_t *primitives = json_object_get(mesh->json, "primitives");
	for (size_t i = 0; i < json_array_size(primitives) && !g->error_code; i++) {
		const json_t *primitive = json_array_get(primitives, i);
		if (++g->primitive_count > GLTF_PRIMITIVES_MAX)
			gltf_fail(g, mesh, E2BIG, "more than %d primitives", GLTF_PRIMITIVES_MAX);
		else if (json_is_object(primitive))
			put_primitive(g, parent, mesh, node, primitive, *to_world);
		else
			gltf_fail(g, mesh, EINVAL, "its primitives are not objects");
		gltf_record_failure(g);
	}
}

/* ---- meshes of several nodes */

/* Limit on the triangles that copies would add to the first; up to it, copies are faster than instances. */
static const double max_copied_triangles = 200000;

static bool primitive_emits(struct gltf *g, const struct gltf_entry *mesh, const json_t *primitive)
{
	struct gltf_entry material;
	double rgb[3];
	return gltf_resolve(g, mesh, primitive, "material", GLTF_MATERIALS, &material) > 0 &&
	       gltf_material_emits(g, &material, rgb);
}

/* Returns whether the mesh becomes a shapegroup, which may hold neither emitters nor a mesh that each node deforms
 * differently. */
static bool becomes_shapegroup(struct gltf *g, const struct gltf_entry *mesh, const struct gltf_entry *node)
{
	const json_t *primitives = json_object_get(mesh->json, "primitives");
	double corners = 0, uses = g->mesh_use_counts[mesh->index];
	if (uses < 2 || json_object_get(node->json, "skin") || json_object_get(node->json, "weights"))
		return false;
	for (size_t i = 0; i < json_array_size(primitives); i++) {
		const json_t *o = json_array_get(primitives, i), *index = json_object_get(o, "indices");
		if (!json_is_integer(index))
			index = json_object_get(json_object_get(o, "attributes"), "POSITION");
		corners += json_number_value(json_object_get(
			json_array_get(json_object_get(g->root, "accessors"), (size_t)json_integer_value(index)),
			"count"));
		if (primitive_emits(g, mesh, o))
			return false;
	}
	return corners / 3 * (uses - 1) > max_copied_triangles;
}

static void put_instance(struct gltf *g, const struct gltf_entry *mesh, const struct gltf_entry *node,
			 const mat4 *to_world)
{
	static const char id[] = "group of meshes[%zu]";
	const json_t *primitives = json_object_get(mesh->json, "primitives");
	struct gltf_entry a;
	if (!g->is_mesh_made[mesh->index]) {
		const mat4 identity = mat4_identity();
		struct xml_element *group = gltf_add_plugin(g, g->scene, mesh, "shape", "shapegroup", NULL);
		const vec3 low = g->box_min, high = g->box_max;
		gltf_add_attribute(g, group, "id", id, mesh->index);
		put_primitives(g, group, mesh, node, &identity);
		g->box_min = low;
		g->box_max = high;
		g->is_mesh_made[mesh->index] = true;
	}
	for (size_t i = 0; i < json_array_size(primitives); i++)
		if (gltf_resolve(g, mesh, json_object_get(json_array_get(primitives, i), "attributes"), "POSITION",
				 GLTF_ACCESSORS, &a) > 0)
			extend_bounds_by_accessor(g, &a, to_world);
	struct xml_element *instance = gltf_add_plugin(g, g->scene, mesh, "shape", "instance", NULL);
	gltf_add_attribute(g, gltf_add_element(g, instance, mesh, "ref"), "id", id, mesh->index);
	gltf_put_matrix(g, instance, mesh, "to_world", to_world);
}

void gltf_add_mesh(struct gltf *g, const struct gltf_entry *mesh, const struct gltf_entry *node, const mat4 *to_world)
{
	if (becomes_shapegroup(g, mesh, node))
		put_instance(g, mesh, node, to_world);
	else
		put_primitives(g, g->scene, mesh, node, to_world);
}

/* ---- EXT_mesh_gpu_instancing */

/* Returns false if the attribute is missing or cannot be read. */
static bool read_instance_attribute(struct gltf *g, const struct gltf_entry *node, const json_t *attributes,
				    const char *name, unsigned components, struct gltf_vectors *out)
{
	struct gltf_entry a;
	out->values = NULL;
	return gltf_resolve(g, node, attributes, name, GLTF_ACCESSORS, &a) > 0 &&
	       gltf_vectors_read(g, &a, name, components, out);
}

void gltf_add_mesh_instances(struct gltf *g, const struct gltf_entry *mesh, const struct gltf_entry *node,
			     const json_t *extension, const mat4 *to_world)
{
	const json_t *attributes = gltf_object(g, node, extension, "attributes");
	static const char *const attribute_names[3] = {"TRANSLATION", "ROTATION", "SCALE"};
	struct gltf_vectors v[3] = {{.values = NULL}};
	uint64_t count = 0;
	bool has_attribute = false;
	for (int i = 0; i < 3; i++) {
		if (!read_instance_attribute(g, node, attributes, attribute_names[i], i == 1 ? 4 : 3, &v[i]))
			continue;
		if (has_attribute && v[i].count != count)
			gltf_fail(g, node, EINVAL, "attributes of instances with different numbers of entries");
		count = v[i].count;
		has_attribute = true;
	}
	if (!count)
		gltf_fail(g, node, EINVAL, "EXT_mesh_gpu_instancing without instances");
	g->mesh_use_counts[mesh->index] += (double)count;
	for (uint64_t i = 0; i < count && !g->error_code; i++) {
		bool valid;
		mat4 instance_to_world =
			gltf_compose_transform(v[0].values ? v[0].values + 3 * i : (const double[3]){0, 0, 0},
					       v[1].values ? v[1].values + 4 * i : (const double[4]){0, 0, 0, 1},
					       v[2].values ? v[2].values + 3 * i : (const double[3]){1, 1, 1}, &valid);
		instance_to_world = mat4_mul(*to_world, instance_to_world);
		if (valid)
			gltf_add_mesh(g, mesh, node, &instance_to_world);
		else
			gltf_fail(g, node, EINVAL, "the rotation of instance %llu is not a quaternion",
				  (unsigned long long)i);
	}
	for (int i = 0; i < 3; i++)
		gltf_vectors_fini(&v[i]);
}
