/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads members of JSON objects, and makes elements from them, for the reader of glTF. After a failure nothing is added
 * to the tree until gltf_record_failure has recorded it. Failures: members of another type or out of range, and out of
 * memory; each names its place in the file.
 */
#include "worker/render/gltf/gltf_tree.h"

#include "common/base/text.h"
#include "worker/render/xml/element_make.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const array_names[GLTF_ARRAYS] = {
	[GLTF_ACCESSORS] = "accessors", [GLTF_BUFFERS] = "buffers", [GLTF_BUFFER_VIEWS] = "bufferViews",
	[GLTF_CAMERAS] = "cameras",	[GLTF_IMAGES] = "images",   [GLTF_LIGHTS] = "lights",
	[GLTF_MATERIALS] = "materials", [GLTF_MESHES] = "meshes",   [GLTF_NODES] = "nodes",
	[GLTF_SAMPLERS] = "samplers",	[GLTF_SCENES] = "scenes",   [GLTF_SKINS] = "skins",
	[GLTF_TEXTURES] = "textures",
};

const char *gltf_array_name(enum gltf_array array)
{
	return array_names[array];
}

static int entry_line(const struct gltf *g, enum gltf_array array, size_t index)
{
	return index < g->line_count[array] ? g->lines[array][index] : 1;
}

int gltf_fail(struct gltf *g, const struct gltf_entry *entry, int errno_value, const char *format, ...)
{
	char text[512];
	if (g->error_code)
		return g->error_code;
	va_list ap;
	va_start(ap, format);
	vsnprintf(text, sizeof text, format, ap);
	va_end(ap);
	if (entry)
		g->error_code = error_set(g->error, errno_value, "%s:%d: %s[%zu]: %s", g->file,
					  entry_line(g, entry->array, entry->index), array_names[entry->array],
					  entry->index, text);
	else
		g->error_code = error_set(g->error, errno_value, "%s: %s", g->file, text);
	return g->error_code;
}

void gltf_record_failure(struct gltf *g)
{
	struct xml_tree *t = g->tree;
	bool is_fatal = g->error_code == -ENOMEM || g->error_code == -E2BIG || g->error_code == -EFBIG;
	/* A mesh of several nodes gives the same error for each of them. */
	bool is_listed = g->error_code && text_is_among(g->error->text, t->missing, t->missing_count);
	if (g->error_code && !is_fatal && (is_listed || t->missing_count < XML_MISSING_MAX)) {
		const char *text = is_listed ? NULL : arena_strdup(g->arena, g->error->text);
		if (text)
			t->missing[t->missing_count++] = text;
		g->error_code = text || is_listed ? 0 : -ENOMEM;
		t->has_missing_files = true;
	}
}

static void fail_out_of_memory(struct gltf *g)
{
	gltf_fail(g, NULL, ENOMEM, "out of memory, or the scene files take more than %d MB of it",
		  XML_MEMORY_MAX >> 20);
}

bool gltf_find_entry(struct gltf *g, enum gltf_array array, uint64_t index, struct gltf_entry *out)
{
	const json_t *list = array == GLTF_LIGHTS ? g->lights : json_object_get(g->root, array_names[array]);
	*out = (struct gltf_entry){array, (size_t)index, json_array_get(list, (size_t)index)};
	if (json_is_object(out->json))
		return true;
	gltf_fail(g, NULL, EINVAL, out->json ? "%s[%llu] is not an object" : "there is no %s[%llu]", array_names[array],
		  (unsigned long long)index);
	return false;
}

int gltf_resolve(struct gltf *g, const struct gltf_entry *referrer, const json_t *object, const char *key,
		 enum gltf_array array, struct gltf_entry *out)
{
	uint64_t index = gltf_integer(g, referrer, object, key, UINT64_MAX);
	if (g->error_code)
		return g->error_code;
	if (index == UINT64_MAX)
		return 0;
	return gltf_find_entry(g, array, index, out) ? 1 : g->error_code;
}

/* ---- members */

double gltf_number(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key, double fallback)
{
	const json_t *x = json_object_get(o, key);
	if (!x)
		return fallback;
	if (json_is_number(x))
		return json_number_value(x);
	gltf_fail(g, entry, EINVAL, "\"%s\" is not a number", key);
	return fallback;
}

uint64_t gltf_integer(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key,
		      uint64_t fallback)
{
	const json_t *x = json_object_get(o, key);
	double value = x ? json_number_value(x) : 0;
	if (!x)
		return fallback;
	if (json_is_number(x) && value >= 0 && value <= GLTF_INTEGER_MAX && value == floor(value))
		return (uint64_t)value;
	gltf_fail(g, entry, EINVAL, "\"%s\" is not a whole number from 0 to %.0f", key, GLTF_INTEGER_MAX);
	return fallback;
}

const char *gltf_string(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key,
			const char *fallback)
{
	const json_t *x = json_object_get(o, key);
	if (!x)
		return fallback;
	if (json_is_string(x))
		return json_string_value(x);
	gltf_fail(g, entry, EINVAL, "\"%s\" is not a string", key);
	return fallback;
}

void gltf_numbers(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key, double *x,
		  size_t count)
{
	const json_t *list = json_object_get(o, key);
	if (!list)
		return;
	bool is_valid = json_is_array(list) && json_array_size(list) == count;
	for (size_t i = 0; i < count && is_valid; i++) {
		const json_t *item = json_array_get(list, i);
		is_valid = json_is_number(item);
		x[i] = json_number_value(item);
	}
	if (!is_valid)
		gltf_fail(g, entry, EINVAL, "\"%s\" is not an array of %zu numbers", key, count);
}

const json_t *gltf_object(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *key)
{
	const json_t *x = json_object_get(o, key);
	if (x && !json_is_object(x))
		gltf_fail(g, entry, EINVAL, "\"%s\" is not an object", key);
	return json_is_object(x) ? x : NULL;
}

const json_t *gltf_extension(struct gltf *g, const struct gltf_entry *entry, const json_t *o, const char *name)
{
	const json_t *all = gltf_object(g, entry, o, "extensions");
	return all ? gltf_object(g, entry, all, name) : NULL;
}

/* ---- elements */

__attribute__((format(printf, 2, 0))) static char *format_text(struct gltf *g, const char *format, va_list ap)
{
	va_list ap_copy;
	va_copy(ap_copy, ap);
	int n = vsnprintf(NULL, 0, format, ap);
	char *text = n >= 0 ? arena_alloc(g->arena, (size_t)n + 1, 1) : NULL;
	if (text)
		vsnprintf(text, (size_t)n + 1, format, ap_copy);
	else
		fail_out_of_memory(g);
	va_end(ap_copy);
	return text;
}

struct xml_element *gltf_add_element(struct gltf *g, struct xml_element *parent, const struct gltf_entry *entry,
				     const char *name)
{
	if (g->error_code || (!parent && g->scene))
		return NULL;
	if (g->tree->element_count >= XML_ELEMENTS_MAX) {
		gltf_fail(g, entry, E2BIG, "this file becomes more than %d elements", XML_ELEMENTS_MAX);
		return NULL;
	}
	struct xml_element *el =
		element_make(parent, name, g->file, entry ? entry_line(g, entry->array, entry->index) : 1, g->arena);
	if (!el) {
		fail_out_of_memory(g);
		return NULL;
	}
	g->tree->element_count++;
	return el;
}

void gltf_add_attribute(struct gltf *g, struct xml_element *el, const char *name, const char *format, ...)
{
	if (!el || g->error_code)
		return;
	va_list ap;
	va_start(ap, format);
	char *value = format_text(g, format, ap);
	va_end(ap);
	if (value)
		element_add_attribute(el, name, value);
}

struct xml_element *gltf_add_plugin(struct gltf *g, struct xml_element *parent, const struct gltf_entry *entry,
				    const char *cls, const char *type, const char *name)
{
	struct xml_element *el = gltf_add_element(g, parent, entry, cls);
	gltf_add_attribute(g, el, "type", "%s", type);
	if (name)
		gltf_add_attribute(g, el, "name", "%s", name);
	return el;
}

static struct xml_element *put_element(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry,
				       const char *element, const char *name)
{
	struct xml_element *p = el ? gltf_add_element(g, el, entry, element) : NULL;
	gltf_add_attribute(g, p, "name", "%s", name);
	return p;
}

void gltf_put_number(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name, double x)
{
	gltf_add_attribute(g, put_element(g, el, entry, "float", name), "value", "%.17g", x);
}

void gltf_put_integer(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		      uint64_t x)
{
	gltf_add_attribute(g, put_element(g, el, entry, "integer", name), "value", "%llu", (unsigned long long)x);
}

void gltf_put_bool(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name, bool x)
{
	gltf_add_attribute(g, put_element(g, el, entry, "boolean", name), "value", "%s", x ? "true" : "false");
}

void gltf_put_string(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		     const char *text)
{
	gltf_add_attribute(g, put_element(g, el, entry, "string", name), "value", "%s", text);
}

void gltf_put_rgb(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		  const double rgb[3])
{
	gltf_add_attribute(g, put_element(g, el, entry, "rgb", name), "value", "%.17g %.17g %.17g", rgb[0], rgb[1],
			   rgb[2]);
}

void gltf_put_matrix(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const char *name,
		     const mat4 *m)
{
	char text[16 * 26];
	struct text t = {text, sizeof text};
	for (int i = 0; i < 16; i++)
		text_appendf(&t, "%s%.17g", i ? " " : "", m->m[i / 4][i % 4]);
	struct xml_element *transform = put_element(g, el, entry, "transform", name),
			   *matrix = transform ? gltf_add_element(g, transform, entry, "matrix") : NULL;
	gltf_add_attribute(g, matrix, "value", "%s", text);
}

void gltf_note(struct gltf *g, const char *text)
{
	for (uint32_t i = 0; i < g->tree->note_count; i++)
		if (strcmp(g->tree->notes[i], text) == 0)
			return;
	if (g->error_code || g->tree->note_count >= XML_NOTES_MAX)
		return;
	const char *copy = arena_strdup(g->arena, text);
	if (copy)
		g->tree->notes[g->tree->note_count++] = copy;
	else
		gltf_fail(g, NULL, ENOMEM, "out of memory");
}

bool gltf_lists_extension(const struct gltf *g, const char *list, const char *extension)
{
	enum { LISTED_MAX = 64 };
	const json_t *names = json_object_get(g->root, list);
	for (size_t i = 0; i < json_array_size(names) && i < LISTED_MAX; i++) {
		const char *name = json_string_value(json_array_get(names, i));
		if (name && strcmp(name, extension) == 0)
			return true;
	}
	return false;
}

bool gltf_is_known_extension(const char *extension)
{
	static const char *const known_extensions[] = {
		"EXT_mesh_gpu_instancing", "EXT_meshopt_compression", "EXT_texture_avif", "EXT_texture_webp",
		"KHR_draco_mesh_compression", "KHR_lights_punctual", "KHR_materials_anisotropy",
		"KHR_materials_clearcoat", "KHR_materials_diffuse_transmission", "KHR_materials_dispersion",
		"KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_iridescence",
		"KHR_materials_pbrSpecularGlossiness", "KHR_materials_sheen", "KHR_materials_specular",
		"KHR_materials_transmission", "KHR_materials_unlit", "KHR_materials_volume", "KHR_mesh_quantization",
		"KHR_meshopt_compression", "KHR_node_visibility", "KHR_texture_basisu", "KHR_texture_transform",
		"MSFT_texture_dds",
		/* These do not change light: polygons of triangles, alternative looks, metadata, and levels of less
		   detail, which are left out. */
		"FB_ngon_encoding", "KHR_materials_variants", "KHR_xmp", "KHR_xmp_json_ld", "MSFT_lod"};
	return text_is_among(extension, known_extensions, sizeof known_extensions / sizeof *known_extensions);
}

void gltf_extend_bounds(struct gltf *g, vec3 p)
{
	g->box_min = (vec3){fmin(g->box_min.x, p.x), fmin(g->box_min.y, p.y), fmin(g->box_min.z, p.z)};
	g->box_max = (vec3){fmax(g->box_max.x, p.x), fmax(g->box_max.y, p.y), fmax(g->box_max.z, p.z)};
}
