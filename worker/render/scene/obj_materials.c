/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Splits OBJ shapes with several materials into shapes with one material each.
 *
 * The walk visits each OBJ shape of the tree. For a shape that may have several materials, it reads the names of
 * materials in the file, then the .mtl file, and chooses for each name the BSDF of the shape or the entry of the .mtl
 * file. If it finds any, the element becomes a `merge` with a copy of the shape for each material. Otherwise the
 * element stays as it is. The 3.x format does not have this feature: its scenes are not changed.
 *
 * A missing OBJ file is an error here only if the shape has several BSDFs; otherwise it is reported when the shape is
 * built. Problems go to the report, and the walk continues with the next shape. -ENOMEM ends it.
 */
#include "worker/render/scene/obj_materials.h"

#include "common/base/fnv.h"
#include "common/base/liveness.h"
#include "worker/render/xml/element_make.h"
#include "worker/render/scene/mtl.h"
#include "worker/render/text/number.h"
#include "worker/render/text/text_lines.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

struct obj_splitter {
	struct xml_tree *tree;
	struct id_table *ids;
	const struct asset_source *assets;
	struct asset_list *files;
	struct arena *arena;
	struct report *report;
	struct error *error;
	struct material *materials; /* scratch space for the current shape's materials; NULL: not allocated yet */
	uint32_t *buckets;
};

/* An element inside a shape. */
struct child {
	const struct xml_element *el;
	bool is_bsdf;
	const char *name; /* of a BSDF that has one; otherwise NULL */
};

struct material {
	const char *name;
	size_t length;
	bool has_faces;			/* anywhere in the file */
	bool is_wanted;			/* it has faces in the mesh that the shape asks for */
	const struct xml_element *bsdf; /* the BSDF given in the shape, or NULL */
	const struct mtl_material *mtl; /* if there is no bsdf: the entry of the .mtl file, or NULL */
};

/* The current shape. */
struct obj_shape {
	struct xml_element *el;
	const char *file; /* NULL: the shape names none */
	struct asset contents;
	struct child *children;
	size_t child_count, unnamed_count, named_count; /* unnamed_count, named_count: of BSDFs */
	/* The shape asks for the .mtl file; it states itself which faces it wants. */
	bool loads_library, is_fixed;
	int64_t mesh_index;	    /* shape_index; negative: all meshes */
	struct material *materials; /* [OBJ_MATERIALS_MAX] */
	uint32_t *buckets;	    /* hash table of BUCKETS entries by name: 1 + index, or 0 if free */
	size_t material_count;
	const char *library; /* name in the last mtllib, or NULL */
	size_t library_length;
	struct mtl mtl;
};

enum { BUCKETS = 2 * OBJ_MATERIALS_MAX };

static int out_of_memory(const struct obj_splitter *s)
{
	return error_set(s->error, ENOMEM, "out of memory while reading the materials of an OBJ file");
}

/* ---- what a shape states */

static bool is_property(const struct xml_element *el, const char *element, const char *name, const char *snake)
{
	const char *written = xml_attribute_value(el, "name");
	return strcmp(el->name, element) == 0 && written && (strcmp(written, name) == 0 || strcmp(written, snake) == 0);
}

/* Returns what an element inside a shape is, with references followed: "bsdf", "emitter" and so on. */
static const char *element_kind(const struct obj_splitter *s, const struct xml_element *el)
{
	struct error unused;
	struct xml_element *target;
	if (strcmp(el->name, "ref") == 0 && id_table_resolve(s->ids, el, &target, &unused) == 0)
		return target->name;
	return el->name;
}

static int read_children(const struct obj_splitter *s, struct obj_shape *o)
{
	size_t n = 0;
	for (const struct xml_element *c = o->el->first_child; c; c = c->next_sibling)
		n++;
	o->children = arena_alloc(s->arena, n, sizeof *o->children);
	if (!o->children)
		return out_of_memory(s);
	for (const struct xml_element *c = o->el->first_child; c; c = c->next_sibling) {
		const char *kind = element_kind(s, c), *value = xml_attribute_value(c, "value");
		bool is_bsdf = strcmp(kind, "bsdf") == 0 && !c->is_ignored;
		const char *name = is_bsdf ? xml_attribute_value(c, "name") : NULL;
		o->children[o->child_count++] = (struct child){c, is_bsdf, name};
		o->unnamed_count += is_bsdf && !name;
		o->named_count += is_bsdf && name;
		if (is_property(c, "string", "filename", "filename"))
			o->file = value;
		if (is_property(c, "boolean", "loadMaterials", "load_materials") && value)
			o->loads_library = strcasecmp(value, "false") != 0;
		if (is_property(c, "integer", "shapeIndex", "shape_index") && value)
			number_scan_int(value, value + strlen(value), &o->mesh_index);
		o->is_fixed |= is_property(c, "string", "material", "material") ||
			       is_property(c, "boolean", "collapse", "collapse");
	}
	return 0;
}

/* ---- what the OBJ file states */

/* Returns the entry for a name, added if necessary; NULL if there are too many materials. */
static struct material *find_or_add_material(struct obj_shape *o, const char *name, size_t length)
{
	uint32_t bucket = (uint32_t)(fnv_add(FNV_OFFSET_BASIS, name, length) % BUCKETS);
	for (; o->buckets[bucket]; bucket = (bucket + 1) % BUCKETS) {
		struct material *m = &o->materials[o->buckets[bucket] - 1];
		if (m->length == length && memcmp(m->name, name, length) == 0)
			return m;
	}
	if (o->material_count == OBJ_MATERIALS_MAX)
		return NULL;
	struct material *m = &o->materials[o->material_count];
	*m = (struct material){.name = name, .length = length};
	o->buckets[bucket] = (uint32_t)++o->material_count;
	return m;
}

static int scan_obj(const struct obj_splitter *s, struct obj_shape *o)
{
	const char *bytes = (const char *)o->contents.bytes;
	struct text_lines lines = {.cursor = bytes, .end = bytes + o->contents.size};
	struct material *current = find_or_add_material(o, "", 0);
	int64_t mesh = -1; /* counted as obj_read.h says */
	bool in_mesh = false;
	for (struct text_line l; text_lines_next(&lines, &l);) {
		liveness_tick();
		if (text_line_is(&l, "f")) {
			mesh += !in_mesh;
			in_mesh = current->has_faces = true;
			current->is_wanted |= o->mesh_index < 0 || mesh == o->mesh_index;
		} else if (text_line_is(&l, "g")) {
			in_mesh = false;
		} else if (text_line_is(&l, "usemtl")) {
			in_mesh = false;
			current = find_or_add_material(o, l.rest, l.rest_length);
			if (!current)
				return xml_error(o->el, s->error, E2BIG, "%s:%d: more than %d materials", o->file,
						 l.number, OBJ_MATERIALS_MAX);
		} else if (text_line_is(&l, "mtllib")) {
			o->library = l.rest;
			o->library_length = l.rest_length;
		}
	}
	return 0;
}

static int read_library(const struct obj_splitter *s, struct obj_shape *o)
{
	if (!o->library)
		return 0;
	const char *file = mtl_resolve_file(s->assets, o->file, o->library, o->library_length, s->arena);
	if (!file)
		return out_of_memory(s);
	int r = mtl_read(&o->mtl, s->assets, file, s->arena, s->error);
	if (!r && o->mtl.file_exists && asset_list_add(s->files, file, o->el, s->arena))
		r = out_of_memory(s);
	return r;
}

/* ---- the choice of materials */

/* Chooses the last applicable BSDF of the shape for each material. *found_count: the number of materials with faces
 * that have a BSDF or an entry in the .mtl file. */
static int choose_bsdfs(const struct obj_splitter *s, struct obj_shape *o, size_t *found_count)
{
	*found_count = 0;
	for (size_t i = 0; i < o->material_count; i++) {
		struct material *m = &o->materials[i];
		char *name = arena_alloc(s->arena, m->length + 1, 1);
		if (!name)
			return out_of_memory(s);
		memcpy(name, m->name, m->length);
		name[m->length] = 0;
		m->name = name;
		for (size_t k = 0; k < o->child_count; k++) {
			const struct child *c = &o->children[k];
			if (c->is_bsdf && (!c->name || strcmp(c->name, name) == 0))
				m->bsdf = c->el;
		}
		if (!m->bsdf && o->loads_library)
			m->mtl = mtl_find(&o->mtl, name);
		*found_count += m->is_wanted && (m->bsdf || m->mtl);
	}
	return 0;
}

/* Returns whether the shape has a single BSDF, with a name that is not a material of the file: it applies to all
 * faces. */
static bool applies_to_all(struct obj_shape *o)
{
	for (size_t k = 0; k < o->child_count && o->named_count == 1 && o->unnamed_count == 0; k++) {
		const char *name = o->children[k].name;
		const struct material *m = name ? find_or_add_material(o, name, strlen(name)) : NULL;
		if (m && !m->has_faces)
			return true;
	}
	return false;
}

/* ---- splitting the shape */

static int count_elements(const struct obj_splitter *s, const struct xml_element *element, int added)
{
	if (added < 0)
		return out_of_memory(s);
	if (s->tree->element_count > XML_ELEMENTS_MAX - (uint32_t)added)
		return xml_error(element, s->error, E2BIG, "materials make more than %d elements of the scene",
				 XML_ELEMENTS_MAX);
	s->tree->element_count += (uint32_t)added;
	return 0;
}

/* Appends a copy of `el` to `parent`; without_name: without its name. */
static struct xml_element *append_copy(const struct obj_splitter *s, struct xml_element *parent,
				       const struct xml_element *el, bool without_name)
{
	struct xml_element *copy = arena_alloc(s->arena, 1, sizeof *copy);
	struct xml_attribute *attributes = arena_alloc(s->arena, el->attribute_count, sizeof *attributes);
	if (!copy || !attributes)
		return NULL;
	*copy = *el;
	copy->next_sibling = NULL;
	copy->attributes = attributes;
	copy->attribute_count = 0;
	for (uint32_t i = 0; i < el->attribute_count; i++)
		if (!without_name || strcmp(el->attributes[i].name, "name") != 0)
			attributes[copy->attribute_count++] = el->attributes[i];
	element_append(parent, copy);
	return copy;
}

static int add_part(const struct obj_splitter *s, const struct obj_shape *o, struct xml_element *merge,
		    const struct material *m)
{
	int element_count = 2;
	struct xml_element *part = element_make(merge, "shape", o->el->file, o->el->line, s->arena), *name;
	if (!part)
		return out_of_memory(s);
	part->is_camel_case = true;
	element_add_attribute(part, "type", "obj");
	for (size_t k = 0; k < o->child_count; k++, element_count++) {
		const struct child *c = &o->children[k];
		if ((!c->is_bsdf || c->el == m->bsdf) && !append_copy(s, part, c->el, c->is_bsdf))
			return out_of_memory(s);
	}
	name = element_make(part, "string", o->el->file, o->el->line, s->arena);
	if (!name)
		return out_of_memory(s);
	element_add_attribute(name, "name", "material");
	element_add_attribute(name, "value", m->name);
	int r = count_elements(s, o->el, element_count);
	return r || !m->mtl ? r : count_elements(s, o->el, mtl_add_bsdf(&o->mtl, m->mtl, part, s->arena));
}

/* Turns the element itself into the merge, so that references to it find all of its shapes. */
static int replace_by_merge(const struct obj_splitter *s, const struct obj_shape *o)
{
	struct xml_element *merge = element_make(NULL, o->el->name, o->el->file, o->el->line, s->arena);
	if (!merge)
		return out_of_memory(s);
	const char *id = xml_attribute_value(o->el, "id");
	element_add_attribute(merge, "type", "merge");
	if (id)
		element_add_attribute(merge, "id", id);
	int r = 0;
	for (size_t i = 0; i < o->material_count && !r; i++)
		if (o->materials[i].is_wanted)
			r = add_part(s, o, merge, &o->materials[i]);
	if (r)
		return r;
	merge->parent = o->el->parent;
	merge->next_sibling = o->el->next_sibling;
	merge->is_camel_case = true;
	for (struct xml_element *part = merge->first_child; part; part = part->next_sibling)
		part->parent = o->el;
	*o->el = *merge;
	return 0;
}

/* ---- notes */

__attribute__((format(printf, 3, 4))) static int add_note(const struct obj_splitter *s, const struct obj_shape *o,
							  const char *format, ...)
{
	char text[REPORT_TEXT_MAX];
	va_list ap;
	int length = snprintf(text, sizeof text, "%s:%d: <shape type=\"obj\">: ", o->el->file, o->el->line);
	va_start(ap, format);
	vsnprintf(text + length, sizeof text - (size_t)length, format, ap);
	va_end(ap);
	return report_note_text(s->report, o->el->file, text, text, s->error);
}

static int add_notes(const struct obj_splitter *s, struct obj_shape *o)
{
	int r = 0;
	unsigned grey_count = 0;
	const char *first = NULL;
	for (size_t k = 0; k < o->child_count && !r; k++) {
		const char *name = o->children[k].name;
		const struct material *m = name ? find_or_add_material(o, name, strlen(name)) : NULL;
		if (m && !m->has_faces)
			r = add_note(s, o, "no face of %.128s has the material `%.64s`: this bsdf is not used", o->file,
				     name);
	}
	for (size_t i = 0; i < o->material_count; i++)
		if (o->materials[i].is_wanted && !o->materials[i].bsdf && !o->materials[i].mtl) {
			first = first ? first : o->materials[i].name;
			grey_count++;
		}
	if (!r && grey_count)
		r = add_note(
			s, o,
			"%u of the materials of %.128s (first: `%.64s`) %s neither a bsdf nor an entry in a .mtl file: "
			"diffuse and grey",
			grey_count, o->file, first, grey_count == 1 ? "has" : "have");
	if (!r && o->mtl.unsupported.line)
		r = add_note(s, o, "%.128s:%d: `%s` is not read, as Mitsuba does not read it", o->mtl.file,
			     o->mtl.unsupported.line, o->mtl.unsupported.text);
	return r;
}

/* ---- walking the tree */

/* Not if the file has no faces, or not as many meshes as the shape's index: an error when the shape is built. */
static bool wants_any_material(const struct obj_shape *o)
{
	for (size_t i = 0; i < o->material_count; i++)
		if (o->materials[i].is_wanted)
			return true;
	return false;
}

static int split_open_shape(const struct obj_splitter *s, struct obj_shape *o)
{
	size_t found_count = 0;
	int r = scan_obj(s, o);
	if (r || applies_to_all(o))
		return r;
	if (o->loads_library)
		r = read_library(s, o);
	if (!r)
		r = choose_bsdfs(s, o, &found_count);
	if (r || !wants_any_material(o) || (found_count == 0 && o->named_count < (o->mesh_index < 0 ? 2 : 1)))
		return r; /* shapes whose materials are not read are counted by the world's builder */
	r = add_notes(s, o);
	return r ? r : replace_by_merge(s, o);
}

static bool alloc_scratch(struct obj_splitter *s)
{
	s->materials = s->materials ? s->materials : arena_alloc(s->arena, OBJ_MATERIALS_MAX, sizeof *s->materials);
	s->buckets = s->buckets ? s->buckets : arena_alloc(s->arena, BUCKETS, sizeof *s->buckets);
	return s->materials && s->buckets;
}

static int split_shape(struct obj_splitter *s, struct xml_element *el)
{
	struct obj_shape o = {.el = el, .loads_library = true, .mesh_index = -1};
	struct error missing;
	int r = read_children(s, &o);
	bool may_have_materials = o.named_count > 0 || (o.unnamed_count == 0 && o.loads_library && !o.is_fixed);
	if (r || !o.file || !may_have_materials || element_is_unset(el))
		return r;
	if (s->assets->open(s->assets->user, o.file, &o.contents, &missing)) {
		if (o.named_count + o.unnamed_count < 2)
			return 0; /* reported when the shape is built */
		el->is_rejected = true;
		return xml_error(el, s->error, ENOENT, "%.400s", missing.text);
	}
	if (alloc_scratch(s)) {
		o.materials = s->materials;
		o.buckets = s->buckets;
		memset(o.buckets, 0, BUCKETS * sizeof *o.buckets);
		r = split_open_shape(s, &o);
	} else {
		r = out_of_memory(s);
	}
	s->assets->close(s->assets->user, &o.contents);
	return r;
}

static int split_shapes(struct obj_splitter *s, struct xml_element *el)
{
	int r = 0;
	for (struct xml_element *c = el->first_child; c && !r; c = c->next_sibling) {
		const char *type = xml_attribute_value(c, "type");
		if (c->is_ignored)
			continue;
		if (c->is_camel_case && strcmp(c->name, "shape") == 0 && type && strcasecmp(type, "obj") == 0)
			r = report_problem(s->report, split_shape(s, c), s->error);
		else
			r = split_shapes(s, c);
	}
	return r;
}

int obj_materials_split(struct xml_tree *t, struct id_table *ids, const struct asset_source *assets,
			struct asset_list *files, struct arena *arena, struct report *report, struct error *e)
{
	struct obj_splitter s = {
		.tree = t, .ids = ids, .assets = assets, .files = files, .arena = arena, .report = report, .error = e};
	return t->is_dialect_3 ? 0 : split_shapes(&s, t->root);
}
