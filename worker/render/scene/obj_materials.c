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

struct spread {
	struct xml_tree *tree;
	struct id_table *ids;
	const struct asset_source *assets;
	struct asset_list *files;
	struct arena *arena;
	struct report *report;
	struct error *error;
	struct material *materials; /* scratch space for the current shape's materials; NULL: not allocated yet */
	uint32_t *places;
};

/* An element inside a shape. */
struct child {
	const struct xml_element *el;
	bool bsdf;
	const char *name; /* of a BSDF that has one; otherwise NULL */
};

struct material {
	const char *name;
	size_t length;
	bool has_faces;			/* anywhere in the file */
	bool wanted;			/* it has faces in the mesh that the shape asks for */
	const struct xml_element *bsdf; /* the BSDF given in the shape, or NULL */
	const struct mtl_material *mtl; /* if there is no bsdf: the entry of the .mtl file, or NULL */
};

/* The current shape. */
struct obj_shape {
	struct xml_element *el;
	const char *file; /* NULL: the shape names none */
	struct asset bytes;
	struct child *children;
	size_t child_count, plain, named; /* plain, named: number of BSDFs without and with a name */
	bool load, fixed; /* load: the shape asks for the .mtl file; fixed: it emits light, or states itself which faces
			     it wants */
	int64_t mesh;	  /* shape_index; negative: all meshes */
	struct material *materials; /* [OBJ_MATERIALS_MAX] */
	uint32_t *places;	    /* hash table of PLACES entries by name: 1 + index, or 0 if free */
	size_t count;
	const char *library; /* name in the last mtllib, or NULL */
	size_t library_length;
	struct mtl mtl;
};

enum { PLACES = 2 * OBJ_MATERIALS_MAX };

static int out_of_memory(const struct spread *s)
{
	return error_set(s->error, ENOMEM, "out of memory while reading the materials of an OBJ file");
}

/* ---- what a shape states */

static bool is_property(const struct xml_element *el, const char *element, const char *name, const char *snake)
{
	const char *written = xml_attribute(el, "name");
	return strcmp(el->name, element) == 0 && written && (strcmp(written, name) == 0 || strcmp(written, snake) == 0);
}

/* Returns what an element inside a shape is, with references followed: "bsdf", "emitter" and so on. */
static const char *kind_of(const struct spread *s, const struct xml_element *el)
{
	struct error unused;
	struct xml_element *target;
	if (strcmp(el->name, "ref") == 0 && id_table_find(s->ids, el, &target, &unused) == 0)
		return target->name;
	return el->name;
}

static int read_children(const struct spread *s, struct obj_shape *o)
{
	size_t n = 0;
	for (const struct xml_element *c = o->el->first; c; c = c->next)
		n++;
	o->children = arena_alloc(s->arena, n, sizeof *o->children);
	if (!o->children)
		return out_of_memory(s);
	for (const struct xml_element *c = o->el->first; c; c = c->next) {
		const char *kind = kind_of(s, c), *value = xml_attribute(c, "value");
		bool bsdf = strcmp(kind, "bsdf") == 0 && !c->ignored;
		const char *name = bsdf ? xml_attribute(c, "name") : NULL;
		o->children[o->child_count++] = (struct child){c, bsdf, name};
		o->plain += bsdf && !name;
		o->named += bsdf && name;
		if (is_property(c, "string", "filename", "filename"))
			o->file = value;
		if (is_property(c, "boolean", "loadMaterials", "load_materials") && value)
			o->load = strcasecmp(value, "false") != 0;
		if (is_property(c, "integer", "shapeIndex", "shape_index") && value)
			number_scan_int(value, value + strlen(value), &o->mesh);
		o->fixed |= is_property(c, "string", "material", "material") ||
			    is_property(c, "boolean", "collapse", "collapse");
	}
	return 0;
}

/* ---- what the OBJ file states */

/* Returns the entry for a name, added if necessary; NULL if there are too many materials. */
static struct material *material_of(struct obj_shape *o, const char *name, size_t length)
{
	uint32_t at = (uint32_t)(fnv_add(FNV_BEGIN, name, length) % PLACES);
	for (; o->places[at]; at = (at + 1) % PLACES) {
		struct material *m = &o->materials[o->places[at] - 1];
		if (m->length == length && memcmp(m->name, name, length) == 0)
			return m;
	}
	if (o->count == OBJ_MATERIALS_MAX)
		return NULL;
	struct material *m = &o->materials[o->count];
	*m = (struct material){.name = name, .length = length};
	o->places[at] = (uint32_t)++o->count;
	return m;
}

static int scan(const struct spread *s, struct obj_shape *o)
{
	const char *bytes = (const char *)o->bytes.bytes;
	struct text_lines lines = {.p = bytes, .end = bytes + o->bytes.size};
	struct material *now = material_of(o, "", 0);
	int64_t mesh = -1; /* counted as obj_read.h says */
	bool in_mesh = false;
	for (struct text_line l; text_lines_next(&lines, &l);) {
		liveness_tick();
		if (text_line_is(&l, "f")) {
			mesh += !in_mesh;
			in_mesh = now->has_faces = true;
			now->wanted |= o->mesh < 0 || mesh == o->mesh;
		} else if (text_line_is(&l, "g")) {
			in_mesh = false;
		} else if (text_line_is(&l, "usemtl")) {
			in_mesh = false;
			now = material_of(o, l.rest, l.rest_length);
			if (!now)
				return xml_error(o->el, s->error, E2BIG, "%s:%d: more than %d materials", o->file,
						 l.number, OBJ_MATERIALS_MAX);
		} else if (text_line_is(&l, "mtllib")) {
			o->library = l.rest;
			o->library_length = l.rest_length;
		}
	}
	return 0;
}

static int read_library(const struct spread *s, struct obj_shape *o)
{
	if (!o->library)
		return 0;
	const char *file = mtl_file(s->assets, o->file, o->library, o->library_length, s->arena);
	if (!file)
		return out_of_memory(s);
	int r = mtl_read(&o->mtl, s->assets, file, s->arena, s->error);
	if (!r && o->mtl.there && asset_list_add(s->files, file, o->el, s->arena))
		r = out_of_memory(s);
	return r;
}

/* ---- the choice of materials */

/* Chooses the last applicable BSDF of the shape for each material. *found: the number of materials with faces that
 * have a BSDF or an entry in the .mtl file. */
static int choose(const struct spread *s, struct obj_shape *o, size_t *found)
{
	*found = 0;
	for (size_t i = 0; i < o->count; i++) {
		struct material *m = &o->materials[i];
		char *name = arena_alloc(s->arena, m->length + 1, 1);
		if (!name)
			return out_of_memory(s);
		memcpy(name, m->name, m->length);
		name[m->length] = 0;
		m->name = name;
		for (size_t k = 0; k < o->child_count; k++) {
			const struct child *c = &o->children[k];
			if (c->bsdf && (!c->name || strcmp(c->name, name) == 0))
				m->bsdf = c->el;
		}
		if (!m->bsdf && o->load)
			m->mtl = mtl_find(&o->mtl, name);
		*found += m->wanted && (m->bsdf || m->mtl);
	}
	return 0;
}

/* Returns whether the shape has a single BSDF, with a name that is not a material of the file: it applies to all
 * faces. */
static bool is_for_all(struct obj_shape *o)
{
	for (size_t k = 0; k < o->child_count && o->named == 1 && o->plain == 0; k++) {
		const char *name = o->children[k].name;
		const struct material *m = name ? material_of(o, name, strlen(name)) : NULL;
		if (m && !m->has_faces)
			return true;
	}
	return false;
}

/* ---- splitting the shape */

static int count_elements(const struct spread *s, const struct xml_element *at, int made)
{
	if (made < 0)
		return out_of_memory(s);
	if (s->tree->element_count > XML_ELEMENTS_MAX - (uint32_t)made)
		return xml_error(at, s->error, E2BIG, "materials make more than %d elements of the scene",
				 XML_ELEMENTS_MAX);
	s->tree->element_count += (uint32_t)made;
	return 0;
}

/* Appends a copy of `el` to `in`; unnamed: without its name. */
static struct xml_element *copy_into(const struct spread *s, struct xml_element *in, const struct xml_element *el,
				     bool unnamed)
{
	struct xml_element *copy = arena_alloc(s->arena, 1, sizeof *copy);
	struct xml_attribute *attributes = arena_alloc(s->arena, el->attribute_count, sizeof *attributes);
	if (!copy || !attributes)
		return NULL;
	*copy = *el;
	copy->next = NULL;
	copy->attributes = attributes;
	copy->attribute_count = 0;
	for (uint32_t i = 0; i < el->attribute_count; i++)
		if (!unnamed || strcmp(el->attributes[i].name, "name") != 0)
			attributes[copy->attribute_count++] = el->attributes[i];
	element_link(in, copy);
	return copy;
}

static int put_part(const struct spread *s, const struct obj_shape *o, struct xml_element *merge,
		    const struct material *m)
{
	int made = 2;
	struct xml_element *part = element_make(merge, "shape", o->el->file, o->el->line, s->arena), *name;
	if (!part)
		return out_of_memory(s);
	part->snake = true;
	element_put(part, "type", "obj");
	for (size_t k = 0; k < o->child_count; k++, made++) {
		const struct child *c = &o->children[k];
		if ((!c->bsdf || c->el == m->bsdf) && !copy_into(s, part, c->el, c->bsdf))
			return out_of_memory(s);
	}
	name = element_make(part, "string", o->el->file, o->el->line, s->arena);
	if (!name)
		return out_of_memory(s);
	element_put(name, "name", "material");
	element_put(name, "value", m->name);
	int r = count_elements(s, o->el, made);
	return r || !m->mtl ? r : count_elements(s, o->el, mtl_put(&o->mtl, m->mtl, part, s->arena));
}

/* Turns the element itself into the merge, so that references to it find all of its shapes. */
static int replace(const struct spread *s, const struct obj_shape *o)
{
	struct xml_element *merge = element_make(NULL, o->el->name, o->el->file, o->el->line, s->arena);
	if (!merge)
		return out_of_memory(s);
	const char *id = xml_attribute(o->el, "id");
	element_put(merge, "type", "merge");
	if (id)
		element_put(merge, "id", id);
	int r = 0;
	for (size_t i = 0; i < o->count && !r; i++)
		if (o->materials[i].wanted)
			r = put_part(s, o, merge, &o->materials[i]);
	if (r)
		return r;
	merge->parent = o->el->parent;
	merge->next = o->el->next;
	merge->snake = true;
	for (struct xml_element *part = merge->first; part; part = part->next)
		part->parent = o->el;
	*o->el = *merge;
	return 0;
}

/* ---- notes */

__attribute__((format(printf, 3, 4))) static int say(const struct spread *s, const struct obj_shape *o,
						     const char *format, ...)
{
	char text[REPORT_TEXT_MAX];
	va_list ap;
	int used = snprintf(text, sizeof text, "%s:%d: <shape type=\"obj\">: ", o->el->file, o->el->line);
	va_start(ap, format);
	vsnprintf(text + used, sizeof text - (size_t)used, format, ap);
	va_end(ap);
	return report_text(s->report, o->el->file, text, text, s->error);
}

static int note_all(const struct spread *s, struct obj_shape *o)
{
	int r = 0;
	unsigned grey = 0;
	const char *first = NULL;
	for (size_t k = 0; k < o->child_count && !r; k++) {
		const char *name = o->children[k].name;
		const struct material *m = name ? material_of(o, name, strlen(name)) : NULL;
		if (m && !m->has_faces)
			r = say(s, o, "no face of %.128s has the material `%.64s`: this bsdf is not used", o->file,
				name);
	}
	for (size_t i = 0; i < o->count; i++)
		if (o->materials[i].wanted && !o->materials[i].bsdf && !o->materials[i].mtl) {
			first = first ? first : o->materials[i].name;
			grey++;
		}
	if (!r && grey)
		r = say(s, o,
			"%u of the materials of %.128s (first: `%.64s`) %s neither a bsdf nor an entry in a .mtl file: "
			"diffuse and grey",
			grey, o->file, first, grey == 1 ? "has" : "have");
	if (!r && o->mtl.unread.line)
		r = say(s, o, "%.128s:%d: `%s` is not read, as Mitsuba does not read it", o->mtl.file,
			o->mtl.unread.line, o->mtl.unread.text);
	return r;
}

/* ---- walking the tree */

/* Not if the file has no faces, or not as many meshes as the shape's index: an error when the shape is built. */
static bool wants_any(const struct obj_shape *o)
{
	for (size_t i = 0; i < o->count; i++)
		if (o->materials[i].wanted)
			return true;
	return false;
}

static int spread_open(const struct spread *s, struct obj_shape *o)
{
	size_t found = 0;
	int r = scan(s, o);
	if (r || is_for_all(o))
		return r;
	if (o->load)
		r = read_library(s, o);
	if (!r)
		r = choose(s, o, &found);
	if (r || !wants_any(o) || (found == 0 && o->named < (o->mesh < 0 ? 2 : 1)))
		return r; /* shapes whose materials are not read are counted by the world's builder */
	r = note_all(s, o);
	return r ? r : replace(s, o);
}

static bool make_room(struct spread *s)
{
	s->materials = s->materials ? s->materials : arena_alloc(s->arena, OBJ_MATERIALS_MAX, sizeof *s->materials);
	s->places = s->places ? s->places : arena_alloc(s->arena, PLACES, sizeof *s->places);
	return s->materials && s->places;
}

static int spread_shape(struct spread *s, struct xml_element *el)
{
	struct obj_shape o = {.el = el, .load = true, .mesh = -1};
	struct error missing;
	int r = read_children(s, &o);
	bool asks = o.named > 0 || (o.plain == 0 && o.load && !o.fixed);
	if (r || !o.file || !asks || element_is_unset(el))
		return r;
	if (s->assets->open(s->assets->user, o.file, &o.bytes, &missing)) {
		if (o.named + o.plain < 2)
			return 0; /* reported when the shape is built */
		el->told = true;
		return xml_error(el, s->error, ENOENT, "%.400s", missing.text);
	}
	if (make_room(s)) {
		o.materials = s->materials;
		o.places = s->places;
		memset(o.places, 0, PLACES * sizeof *o.places);
		r = spread_open(s, &o);
	} else {
		r = out_of_memory(s);
	}
	s->assets->close(s->assets->user, &o.bytes);
	return r;
}

static int walk(struct spread *s, struct xml_element *el)
{
	int r = 0;
	for (struct xml_element *c = el->first; c && !r; c = c->next) {
		const char *type = xml_attribute(c, "type");
		if (c->ignored)
			continue;
		if (c->snake && strcmp(c->name, "shape") == 0 && type && strcasecmp(type, "obj") == 0)
			r = report_problem(s->report, spread_shape(s, c), s->error);
		else
			r = walk(s, c);
	}
	return r;
}

int obj_materials_spread(struct xml_tree *t, struct id_table *ids, const struct asset_source *assets,
			 struct asset_list *files, struct arena *arena, struct report *report, struct error *e)
{
	struct spread s = {
		.tree = t, .ids = ids, .assets = assets, .files = files, .arena = arena, .report = report, .error = e};
	return t->dialect_3 ? 0 : walk(&s, t->root);
}
