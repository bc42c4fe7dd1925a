/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads the container (GLB header and chunks, or plain JSON) and the scene's nodes: each mesh of a node becomes shapes
 * under the product of the matrices above it, each light an emitter, each camera a sensor. jansson parses the JSON; the
 * lines on which entries begin are searched for separately, for messages.
 *
 * Settings that glTF cannot express keep their defaults. The film's aspect ratio is the first camera's; a file without
 * cameras gets one that sees everything, and one without lights a constant environment, both with a note.
 *
 * Failures: a container that contradicts itself, invalid JSON, another version. Indices of missing entries, nodes that
 * are their own ancestors and unknown required extensions are listed, and what depends on them is left out. A feature
 * that is known but not supported becomes a property that no table of parameters has: it is refused there, or left out.
 */
#include "worker/render/gltf/gltf.h"

#include "common/base/text.h"
#include "worker/render/gltf/gltf_animation.h"
#include "worker/render/gltf/gltf_light.h"
#include "worker/render/gltf/gltf_mesh.h"
#include "worker/render/gltf/gltf_node.h"
#include "worker/render/gltf/gltf_numbers.h"
#include "worker/render/gltf/gltf_tree.h"
#include "common/base/bytes.h"
#include "common/base/spelling.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { VISITED_NODES_MAX = 1 << 17, GLB_HEADER_SIZE = 12, GLB_CHUNK_HEADER_SIZE = 8 };
#define GLB_MAGIC 0x46546c67u  /* "glTF" */
#define GLB_JSON 0x4e4f534au   /* "JSON" */
#define GLB_BINARY 0x004e4942u /* "BIN" */

bool gltf_is_file_name(const char *name)
{
	size_t n = strlen(name);
	return (n > 5 && strcmp(name + n - 5, ".gltf") == 0) || (n > 4 && strcmp(name + n - 4, ".glb") == 0);
}

/* ---- lines */

/* Returns the array with that name and makes room for the lines of its entries; GLTF_ARRAYS if there is no such
 * array. */
static enum gltf_array prepare_lines(struct gltf *g, const char *key, size_t n)
{
	for (int i = 0; i < GLTF_ARRAYS; i++) {
		const char *name = gltf_array_name((enum gltf_array)i);
		if (strlen(name) != n || memcmp(name, key, n) != 0)
			continue;
		size_t count = json_array_size(json_object_get(g->root, name));
		if (!g->lines[i] && count)
			g->lines[i] = arena_alloc(g->arena, count, sizeof *g->lines[i]);
		g->line_capacity[i] = g->lines[i] ? count : 0;
		return (enum gltf_array)i;
	}
	return GLTF_ARRAYS;
}

/* Finds the lines on which the entries of the top-level arrays begin, in JSON that is known to be well formed and to
 * have no duplicate keys. */
static void find_entry_lines(struct gltf *g, const char *text, size_t size)
{
	int depth = 0, line = 1;
	enum gltf_array array = GLTF_ARRAYS;
	for (size_t i = 0; i < size; i++) {
		char c = text[i];
		if (c == '"') {
			size_t begin = ++i;
			for (; i < size && text[i] != '"'; i++)
				i += text[i] == '\\';
			if (depth == 1)
				array = prepare_lines(g, text + begin, i - begin);
		} else if (c == '{' || c == '[') {
			if (depth == 2 && array < GLTF_ARRAYS && g->line_count[array] < g->line_capacity[array])
				g->lines[array][g->line_count[array]++] = line;
			depth++;
		} else if (c == '}' || c == ']') {
			depth--;
		} else if (c == '\n') {
			line++;
		}
	}
}

/* ---- the container */

/* Finds the JSON and the binary chunk of a .glb; a .gltf is JSON as a whole. */
static int find_json(struct gltf *g, const char **text, size_t *size)
{
	const unsigned char *p = g->bytes;
	*text = (const char *)p;
	*size = g->size;
	if (g->size < GLB_HEADER_SIZE || get32(p) != GLB_MAGIC)
		return 0;
	if (get32(p + 4) != 2)
		return gltf_fail(g, NULL, EINVAL, "a GLB file of version %u; 2 is supported", get32(p + 4));
	if (get32(p + 8) > g->size)
		return gltf_fail(g, NULL, EINVAL, "its header says %u bytes, but it has %zu", get32(p + 8), g->size);
	size_t end = get32(p + 8), offset = GLB_HEADER_SIZE;
	*size = 0;
	for (int i = 0; offset + GLB_CHUNK_HEADER_SIZE <= end; i++) {
		size_t length = get32(p + offset);
		uint32_t type = get32(p + offset + 4);
		offset += GLB_CHUNK_HEADER_SIZE;
		if (length > end - offset)
			return gltf_fail(g, NULL, EINVAL, "a chunk exceeds the file");
		if (i == 0 && type == GLB_JSON) {
			*text = (const char *)p + offset;
			*size = length;
			while (*size && !(*text)[*size - 1]) /* some writers pad with zeros instead of blanks */
				--*size;
		} else if (i == 1 && type == GLB_BINARY) {
			g->binary_offset = offset;
			g->binary_size = length;
		}
		offset += length;
	}
	return *size ? 0 : gltf_fail(g, NULL, EINVAL, "a GLB file begins with JSON");
}

/* Notes the extensions that the file uses but does not require, and that the reader does not know: their effect is
 * missing. */
static void note_unknown_extensions(struct gltf *g)
{
	const json_t *used = json_object_get(g->root, "extensionsUsed");
	char text[512] = "";
	struct text t = {text, sizeof text};
	for (size_t i = 0; i < json_array_size(used); i++) {
		const char *name = json_string_value(json_array_get(used, i));
		if (name && !gltf_is_known_extension(name) && !gltf_lists_extension(g, "extensionsRequired", name))
			text_appendf(&t, "%s%.64s",
				     *text ? ", " : "these extensions are not supported and ignored: ", name);
	}
	if (*text)
		gltf_note(g, text);
}

/* Determines the exporter from `generator`, which ends in its version. Since 3.4, Blender's exporter writes lamps in
 * lumens by default; since 4.0, Blender's diffuse surfaces are those of the format. */
static void detect_exporter(struct gltf *g, const char *generator)
{
	static const char blender[] = "Khronos glTF Blender I/O v";
	unsigned major = 0, minor = 0;
	g->lamp_scale = 1;
	g->is_from_blender = generator && strncmp(generator, blender, strlen(blender)) == 0;
	if (!g->is_from_blender || sscanf(generator + strlen(blender), "%4u.%4u", &major, &minor) != 2)
		return;
	g->uses_burley_diffuse = major < 4;
	if (major > 3 || (major == 3 && minor >= 4))
		g->lamp_scale = 1.0 / 683;
}

/* Refuses all required extensions that are not supported in one error, so that one run shows everything that has to
 * be exported differently. */
static void check_required_extensions(struct gltf *g)
{
	const json_t *required = json_object_get(g->root, "extensionsRequired");
	char unknown[384] = "";
	size_t count = 0;
	for (size_t i = 0; i < json_array_size(required); i++) {
		char name[65];
		const char *text = json_string_value(json_array_get(required, i));
		snprintf(name, sizeof name, "%s", text ? text : "(no text)");
		if (text && gltf_is_known_extension(text))
			continue;
		spelling_append_to_list(unknown, sizeof unknown, name);
		count++;
	}
	if (count)
		gltf_fail(g, NULL, ENOTSUP, "it requires the extension%s %s, which %s not supported",
			  count == 1 ? "" : "s", unknown, count == 1 ? "is" : "are");
}

static void check_file(struct gltf *g)
{
	const json_t *asset = gltf_object(g, NULL, g->root, "asset");
	const json_t *number = asset ? json_object_get(asset, "version") : NULL; /* as in files of 1.0 */
	if (json_is_number(number) && json_number_value(number) < 2) {
		gltf_fail(g, NULL, EINVAL, "glTF of version %.3g; 2.0 is supported", json_number_value(number));
		return;
	}
	const char *version = asset ? gltf_string(g, NULL, asset, "version", "") : "";
	if (strncmp(version, "2.", 2) != 0)
		gltf_fail(g, NULL, EINVAL, "glTF of version \"%.16s\"; 2.0 is supported", version);
	if (g->error_code)
		return;
	detect_exporter(g, json_string_value(json_object_get(asset, "generator")));
	check_required_extensions(g);
	gltf_record_failure(g);
	note_unknown_extensions(g);
}

/* ---- nodes */

struct node_walk {
	struct gltf *g;
	bool *is_ancestor; /* for each node: it is an ancestor of the current one */
	size_t node_count, visited_count;
};

static bool is_hidden(struct gltf *g, const struct gltf_entry *node)
{
	return json_is_false(json_object_get(gltf_extension(g, node, node->json, "KHR_node_visibility"), "visible"));
}

/* Returns whether a scale of 0 in two or three directions reduces the node's mesh to a line or a point, which is how
 * animations hide objects. A skinned mesh is placed by its joints and therefore not affected. */
static bool is_scaled_away(const struct gltf_entry *node, const mat4 *to_world)
{
	int flat_axes = 0;
	for (int k = 0; k < 3; k++)
		flat_axes += to_world->m[0][k] == 0 && to_world->m[1][k] == 0 && to_world->m[2][k] == 0;
	return flat_axes > 1 && !json_object_get(node->json, "skin");
}

/* Adds the camera, mesh and light of a node. is_hidden_node: only the camera. */
static void add_node_contents(struct gltf *g, const struct gltf_entry *node, const mat4 *to_world, bool is_hidden_node)
{
	struct gltf_entry entry;
	if (gltf_resolve(g, node, node->json, "camera", GLTF_CAMERAS, &entry) > 0)
		gltf_add_camera(g, &entry, to_world);
	gltf_record_failure(g);
	if (is_hidden_node)
		return;
	const json_t *instances = gltf_extension(g, node, node->json, "EXT_mesh_gpu_instancing");
	bool has_mesh = gltf_resolve(g, node, node->json, "mesh", GLTF_MESHES, &entry) > 0;
	if (has_mesh && is_scaled_away(node, to_world)) {
		g->first_scaled_away = g->scaled_away_count++ == 0 ? node->index : g->first_scaled_away;
		has_mesh = false;
	}
	if (has_mesh && instances)
		gltf_add_mesh_instances(g, &entry, node, instances, to_world);
	else if (has_mesh)
		gltf_add_mesh(g, &entry, node, to_world);
	gltf_record_failure(g);
	gltf_resolve(g, node, node->json, "skin", GLTF_SKINS, &entry); /* the mesh may have no joints to use it for */
	gltf_record_failure(g);
	const json_t *light = gltf_extension(g, node, node->json, "KHR_lights_punctual");
	if (light && gltf_resolve(g, node, light, "light", GLTF_LIGHTS, &entry) > 0)
		gltf_add_light(g, &entry, to_world);
	gltf_record_failure(g);
}

static void visit_node(struct node_walk *w, uint64_t index, const mat4 *parent_to_world, int depth, bool is_hidden_node)
{
	struct gltf *g = w->g;
	struct gltf_entry node;
	if (g->error_code || !gltf_find_entry(g, GLTF_NODES, index, &node))
		return;
	if (w->is_ancestor[index] || depth > GLTF_NODE_DEPTH_MAX) {
		gltf_fail(g, &node, ELOOP,
			  w->is_ancestor[index] ? "it is its own ancestor" : "nodes are more than %d deep",
			  GLTF_NODE_DEPTH_MAX);
		return;
	}
	if (++w->visited_count > VISITED_NODES_MAX) {
		gltf_fail(g, &node, E2BIG, "more than %d nodes", VISITED_NODES_MAX);
		return;
	}
	mat4 to_parent = gltf_node_matrix(g, &node), to_world = mat4_mul(*parent_to_world, to_parent);
	is_hidden_node |= is_hidden(g, &node);
	add_node_contents(g, &node, &to_world, is_hidden_node);
	const json_t *children = json_object_get(node.json, "children");
	w->is_ancestor[index] = true;
	for (size_t i = 0; i < json_array_size(children) && !g->error_code; i++) {
		const json_t *child = json_array_get(children, i);
		if (!json_is_integer(child) || json_integer_value(child) < 0)
			gltf_fail(g, &node, EINVAL, "its children are not indices");
		else
			visit_node(w, (uint64_t)json_integer_value(child), &to_world, depth + 1, is_hidden_node);
		gltf_record_failure(g);
	}
	w->is_ancestor[index] = false;
}

/* Returns for each node whether it is a level of less detail of another one (MSFT_lod); NULL if out of memory. */
static bool *find_detail_levels(struct gltf *g, size_t node_count)
{
	const json_t *nodes = json_object_get(g->root, "nodes");
	bool *is_level = arena_alloc(g->arena, node_count + 1, sizeof *is_level);
	for (size_t i = 0; i < node_count && is_level; i++) {
		const json_t *extensions = json_object_get(json_array_get(nodes, i), "extensions"),
			     *ids = json_object_get(json_object_get(extensions, "MSFT_lod"), "ids");
		for (size_t k = 0; k < json_array_size(ids); k++) {
			json_int_t id = json_integer_value(json_array_get(ids, k));
			if (json_is_integer(json_array_get(ids, k)) && id >= 0 && (size_t)id < node_count)
				is_level[id] = true;
		}
	}
	return is_level;
}

/* Visits the root nodes of a file without scenes, which is a library of meshes: most viewers show all of it, but not
 * the levels of less detail. */
static void visit_root_nodes(struct gltf *g, struct node_walk *w, const mat4 *world)
{
	const bool *is_level = find_detail_levels(g, w->node_count);
	if (!is_level) {
		gltf_fail(g, NULL, ENOMEM, "out of memory");
		return;
	}
	gltf_note(g, "it has no scenes: all of its nodes are shown");
	for (size_t i = 0; i < w->node_count && !g->error_code; i++) {
		if (!is_level[i] && gltf_node_is_root(g, i))
			visit_node(w, i, world, 0, false);
		gltf_record_failure(g);
	}
}

static void note_scaled_away(struct gltf *g)
{
	char text[192];
	snprintf(
		text, sizeof text,
		"the mesh%s of %zu node%s, which a scale of 0 makes a line or a point, %s left out (first: nodes[%zu])",
		g->scaled_away_count == 1 ? "" : "es", g->scaled_away_count, g->scaled_away_count == 1 ? "" : "s",
		g->scaled_away_count == 1 ? "is" : "are", g->first_scaled_away);
	if (g->scaled_away_count)
		gltf_note(g, text);
}

static void read_scene(struct gltf *g)
{
	struct gltf_entry scene;
	struct node_walk w = {.g = g, .node_count = json_array_size(json_object_get(g->root, "nodes"))};
	mat4 world = mat4_identity();
	bool has_no_scenes =
		!json_object_get(g->root, "scene") && json_array_size(json_object_get(g->root, "scenes")) == 0;
	if (!has_no_scenes && !gltf_find_entry(g, GLTF_SCENES, gltf_integer(g, NULL, g->root, "scene", 0), &scene))
		return;
	w.is_ancestor = arena_alloc(g->arena, w.node_count ? w.node_count : 1, sizeof *w.is_ancestor);
	if (!w.is_ancestor) {
		gltf_fail(g, NULL, ENOMEM, "out of memory");
		return;
	}
	memset(w.is_ancestor, 0, w.node_count * sizeof *w.is_ancestor);
	if (has_no_scenes) {
		visit_root_nodes(g, &w, &world);
		note_scaled_away(g);
		return;
	}
	const json_t *roots = json_object_get(scene.json, "nodes");
	for (size_t i = 0; i < json_array_size(roots) && !g->error_code; i++) {
		const json_t *root = json_array_get(roots, i);
		if (!json_is_integer(root) || json_integer_value(root) < 0)
			gltf_fail(g, &scene, EINVAL, "its nodes are not indices");
		else
			visit_node(&w, (uint64_t)json_integer_value(root), &world, 0, false);
		gltf_record_failure(g);
	}
	note_scaled_away(g);
}

/* Returns whether the number of values is within its limit, by an upper bound: each value begins with, or comes
 * after, one of the counted characters. */
static bool has_moderate_value_count(const char *text, size_t size)
{
	size_t values = 0;
	bool in_string = false;
	for (size_t i = 0; i < size; i++) {
		if (text[i] == '"')
			in_string = !in_string;
		else if (in_string)
			i += text[i] == '\\';
		else
			values += text[i] == ',' || text[i] == '[' || text[i] == '{';
	}
	return values <= GLTF_VALUES_MAX;
}

static int read_json(struct gltf *g)
{
	const char *text;
	size_t size;
	json_error_t location;
	int rc = find_json(g, &text, &size);
	if (rc)
		return rc;
	static const char bom[] = "\xef\xbb\xbf"; /* forbidden by the standard, but ignored by most readers */
	if (size >= sizeof bom - 1 && memcmp(text, bom, sizeof bom - 1) == 0) {
		text += sizeof bom - 1;
		size -= sizeof bom - 1;
	}
	if (size > GLTF_JSON_MAX)
		return gltf_fail(g, NULL, EFBIG, "more than %d MB of JSON", GLTF_JSON_MAX >> 20);
	if (!has_moderate_value_count(text, size))
		return gltf_fail(g, NULL, E2BIG, "more than %d values in its JSON", GLTF_VALUES_MAX);
	g->root = json_loadb(text, size, JSON_REJECT_DUPLICATES, &location);
	if (!g->root) {
		rc = json_error_code(&location) == json_error_out_of_memory ? ENOMEM : EINVAL;
		g->error_code = error_set(g->error, rc, "%s:%d: %.160s", g->file, location.line, location.text);
		return g->error_code;
	}
	if (!json_is_object(g->root))
		return gltf_fail(g, NULL, EINVAL, "it is not a JSON object");
	find_entry_lines(g, text, size);
	const json_t *lights = gltf_extension(g, NULL, g->root, "KHR_lights_punctual");
	g->lights = json_object_get(lights, "lights");
	return g->error_code;
}

static void *alloc_per_entry(struct gltf *g, enum gltf_array array, size_t size)
{
	return arena_alloc(g->arena, json_array_size(json_object_get(g->root, gltf_array_name(array))) + 1, size);
}

/* Counts the nodes that use each mesh, which decides between copies and instances. Nodes outside the scene count,
 * too: that saves a search and affects only the speed. */
static void count_mesh_uses(struct gltf *g)
{
	const json_t *nodes = json_object_get(g->root, "nodes");
	size_t meshes = json_array_size(json_object_get(g->root, "meshes"));
	for (size_t i = 0; i < json_array_size(nodes); i++) {
		const json_t *mesh = json_object_get(json_array_get(nodes, i), "mesh");
		if (json_is_integer(mesh) && json_integer_value(mesh) >= 0 && (size_t)json_integer_value(mesh) < meshes)
			g->mesh_use_counts[json_integer_value(mesh)]++;
	}
}

static int read_file(struct gltf *g)
{
	if (read_json(g))
		return g->error_code;
	g->buffers = alloc_per_entry(g, GLTF_BUFFERS, sizeof *g->buffers);
	g->images = alloc_per_entry(g, GLTF_IMAGES, sizeof *g->images);
	g->is_material_made = alloc_per_entry(g, GLTF_MATERIALS, sizeof *g->is_material_made);
	g->mesh_use_counts = alloc_per_entry(g, GLTF_MESHES, sizeof *g->mesh_use_counts);
	g->is_mesh_made = alloc_per_entry(g, GLTF_MESHES, sizeof *g->is_mesh_made);
	if (!g->buffers || !g->images || !g->is_material_made || !g->mesh_use_counts || !g->is_mesh_made)
		return gltf_fail(g, NULL, ENOMEM, "out of memory");
	count_mesh_uses(g);
	g->scene = gltf_add_element(g, NULL, NULL, "scene");
	gltf_add_attribute(g, g->scene, "version", "3.0.0");
	g->tree->root = g->scene;
	g->tree->is_dialect_3 = true;
	check_file(g);
	if (g->error_code)
		return g->error_code;
	gltf_apply_animation_start(g);
	gltf_record_failure(g);
	read_scene(g);
	gltf_record_failure(g);
	if (!g->has_camera)
		gltf_add_default_camera(g);
	if (!g->has_light)
		gltf_add_default_light(g);
	return g->error_code;
}

int gltf_read(struct xml_tree *t, const struct asset_source *assets, const char *name, struct arena *arena,
	      struct error *e)
{
	*t = (struct xml_tree){0};
	struct gltf g = {.tree = t,
			 .assets = assets,
			 .arena = arena,
			 .error = e,
			 .box_min = {INFINITY, INFINITY, INFINITY},
			 .box_max = {-INFINITY, -INFINITY, -INFINITY}};
	struct asset file;
	g.file = arena_strdup(arena, name);
	if (!g.file)
		return error_set(e, ENOMEM, "out of memory");
	int rc = assets->open(assets->user, name, &file, e);
	if (rc)
		return rc == -ENOENT ? error_set(e, ENOENT, "%s: %s", name, strerror(ENOENT)) : rc;
	g.bytes = file.bytes;
	g.size = file.size;
	rc = read_file(&g);
	gltf_buffers_close(&g);
	json_decref(g.root);
	assets->close(assets->user, &file);
	return rc;
}
