/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads .mtl files and makes scene elements of their materials.
 *
 * mtl_read reads a file line by line. `newmtl` begins a material, a keyword of the table sets one of its values, and of
 * several values the last one counts. mtl_add_bsdf writes a material as elements: a mask if it is not opaque, inside it
 * a bumpmap if there is one, inside that the BSDF that `illum` selects. The elements are then read like those of the
 * scene file, so values that are not numbers are reported there, with the line in the .mtl file.
 *
 * A file that cannot be opened has no materials. A keyword that would change the image but is not supported is stored
 * in mtl.unsupported, for the caller to report. Too many materials give -E2BIG, lack of memory -ENOMEM.
 */
#include "worker/render/scene/mtl.h"

#include "worker/render/asset/asset_name.h"
#include "worker/render/xml/element_make.h"
#include "worker/render/text/number.h"
#include "worker/render/text/text_lines.h"

#include <stdio.h>
#include <string.h>

static bool can_open(const struct asset_source *assets, const char *name)
{
	struct asset a;
	struct error unused;
	if (assets->open(assets->user, name, &a, &unused))
		return false;
	assets->close(assets->user, &a);
	return true;
}

static const char *resolve_beside(const char *base_file, const char *name, struct arena *arena)
{
	const char *slash = *name != '/' ? strrchr(base_file, '/') : NULL;
	size_t folder = slash ? (size_t)(slash - base_file) + 1 : 0, size = folder + strlen(name);
	char *joined = arena_alloc(arena, size + 1, 1), *out = arena_alloc(arena, ASSET_NAME_SIZE_MAX(size), 1);
	if (!joined || !out)
		return NULL;
	snprintf(joined, size + 1, "%.*s%s", (int)folder, base_file, name);
	asset_name_canonicalize(joined, out);
	return out;
}

static char *copy_text(const char *text, size_t length, struct arena *arena)
{
	char *out = arena_alloc(arena, length + 1, 1);
	if (out) {
		memcpy(out, text, length);
		out[length] = 0;
	}
	return out;
}

const char *mtl_resolve_file(const struct asset_source *assets, const char *beside, const char *name, size_t length,
			     struct arena *arena)
{
	char *written = copy_text(name, length, arena);
	if (!written)
		return NULL;
	for (char *p = written; *p; p++)
		*p = *p == '\\' ? '/' : *p; /* as written on Windows */
	const char *last = strrchr(written, '/'), *out = resolve_beside(beside, written, arena);
	return !out || !last || can_open(assets, out) ? out : resolve_beside(beside, last + 1, arena);
}

/* ---- reading */

static const struct keyword {
	const char *word;
	size_t offset; /* of the mtl_value in struct mtl_material */
	bool is_file;
} keywords[] = {
	{"Kd", offsetof(struct mtl_material, diffuse), false},
	{"Ks", offsetof(struct mtl_material, specular), false},
	{"Ns", offsetof(struct mtl_material, exponent), false},
	{"illum", offsetof(struct mtl_material, model), false},
	{"d", offsetof(struct mtl_material, opacity), false},
	{"map_Kd", offsetof(struct mtl_material, diffuse_map), true},
	{"map_Ks", offsetof(struct mtl_material, specular_map), true},
	{"map_d", offsetof(struct mtl_material, opacity_map), true},
	{"bump", offsetof(struct mtl_material, bump), true},
};

/* Keywords that would change the image but are not read; Mitsuba does not read them either. */
static const char *const unsupported_keywords[] = {"Ke",       "map_Ke", "Tr",	     "Tf",     "map_Ns", "map_bump",
						   "map_Bump", "norm",	 "disp",     "Pr",     "Pm",	 "map_Pr",
						   "map_Pm",   "refl",	 "map_refl", "map_Tr", "decal",	 NULL};

static size_t length_without_comment(const struct text_line *l)
{
	const char *hash = memchr(l->rest, '#', l->rest_length);
	return hash ? (size_t)(hash - l->rest) : l->rest_length;
}

static int read_value(struct mtl *m, struct mtl_material *material, const struct text_line *l,
		      const struct asset_source *assets, struct arena *arena)
{
	for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++) {
		if (!text_line_is(l, keywords[i].word))
			continue;
		struct mtl_value v = {.line = l->number};
		if (keywords[i].is_file)
			v.text = mtl_resolve_file(assets, m->file, l->rest, l->rest_length, arena);
		else
			v.text = copy_text(l->rest, length_without_comment(l), arena);
		if (!v.text)
			return -ENOMEM;
		memcpy((char *)material + keywords[i].offset, &v, sizeof v);
		return 0;
	}
	for (size_t i = 0; unsupported_keywords[i] && !m->unsupported.line; i++)
		if (text_line_is(l, unsupported_keywords[i]))
			m->unsupported = (struct mtl_value){l->number, unsupported_keywords[i]};
	return 0;
}

static int read_lines(struct mtl *m, struct text_lines *lines, const struct asset_source *assets, struct arena *arena,
		      struct error *e)
{
	struct mtl_material *current = NULL;
	int r = 0, count = 0;
	for (struct text_line l; !r && text_lines_next(lines, &l);) {
		if (text_line_is(&l, "newmtl")) {
			if (++count > MTL_MATERIALS_MAX)
				return error_set(e, E2BIG, "%s:%d: more than %d materials", m->file, l.number,
						 MTL_MATERIALS_MAX);
			current = arena_alloc(arena, 1, sizeof *current);
			if (!current)
				break;
			*current = (struct mtl_material){.name = copy_text(l.rest, l.rest_length, arena),
							 .line = l.number,
							 .previous = m->last_material};
			m->last_material = current;
			r = current->name ? 0 : -ENOMEM;
		} else if (current) {
			r = read_value(m, current, &l, assets, arena);
		}
	}
	return r || (count && !current) ? error_set(e, ENOMEM, "%s: out of memory", m->file) : 0;
}

int mtl_read(struct mtl *m, const struct asset_source *assets, const char *file, struct arena *arena, struct error *e)
{
	*m = (struct mtl){.file = file};
	struct asset a;
	struct error unused;
	if (assets->open(assets->user, file, &a, &unused))
		return 0;
	m->file_exists = true;
	struct text_lines lines = {.cursor = (const char *)a.bytes, .end = (const char *)a.bytes + a.size};
	int r = read_lines(m, &lines, assets, arena, e);
	assets->close(assets->user, &a);
	return r;
}

const struct mtl_material *mtl_find(const struct mtl *m, const char *name)
{
	const struct mtl_material *material = m->last_material;
	while (material && strcmp(material->name, name) != 0)
		material = material->previous;
	return material;
}

/* ---- elements */

struct element_builder {
	const struct mtl *mtl;
	struct arena *arena;
	int count; /* number of elements made; negative: out of memory */
};

static struct xml_element *add_element(struct element_builder *k, struct xml_element *parent, const char *element,
				       int line)
{
	struct xml_element *el = k->count < 0 ? NULL : element_make(parent, element, k->mtl->file, line, k->arena);
	k->count = el ? k->count + 1 : -ENOMEM;
	return el;
}

static struct xml_element *add_plugin(struct element_builder *k, struct xml_element *parent, const char *cls,
				      const char *type, const char *name, int line)
{
	struct xml_element *el = add_element(k, parent, cls, line);
	if (el)
		element_add_attribute(el, "type", type);
	if (el && name)
		element_add_attribute(el, "name", name);
	return el;
}

static void add_property(struct element_builder *k, struct xml_element *parent, const char *element, const char *name,
			 const struct mtl_value *v)
{
	struct xml_element *el = add_element(k, parent, element, v->line);
	if (el) {
		element_add_attribute(el, "name", name);
		element_add_attribute(el, "value", v->text);
	}
}

static void add_bitmap(struct element_builder *k, struct xml_element *parent, const char *name,
		       const struct mtl_value *v, bool raw)
{
	struct xml_element *texture = add_plugin(k, parent, "texture", "bitmap", name, v->line);
	add_property(k, texture, "string", "filename", v);
	if (raw)
		add_property(k, texture, "float", "gamma", &(struct mtl_value){v->line, "1"});
}

/* Puts a colour, in sRGB as in Mitsuba, or an image, whichever is given last. */
static void add_colour(struct element_builder *k, struct xml_element *parent, const char *name, int line,
		       const struct mtl_value *v, const struct mtl_value *map)
{
	if (map->line > v->line)
		add_bitmap(k, parent, name, map, false);
	else
		add_property(k, parent, "srgb", name, v->line ? v : &(struct mtl_value){line, "0 0 0"});
}

static bool is_zero(const struct mtl_value *v)
{
	double x[3] = {0};
	int n = v->line ? number_parse_list(v->text, x, 3) : 3;
	return n >= 0 && x[0] == 0 && x[1] == 0 && x[2] == 0;
}

static void add_bsdf(struct element_builder *k, const struct mtl_material *material, struct xml_element *parent)
{
	int64_t model = 0;
	if (material->model.line && !number_parse_int(material->model.text, &model))
		model = 0;
	bool has_specular = material->specular_map.line > material->specular.line || !is_zero(&material->specular);
	if (model == 2 && has_specular && !is_zero(&material->exponent)) {
		struct xml_element *phong = add_plugin(k, parent, "bsdf", "phong", NULL, material->line);
		add_colour(k, phong, "diffuse_reflectance", material->line, &material->diffuse, &material->diffuse_map);
		add_colour(k, phong, "specular_reflectance", material->line, &material->specular,
			   &material->specular_map);
		add_property(k, phong, "float", "exponent", &material->exponent);
	} else if (model == 4 || model == 6 || model == 7 || model == 9) {
		add_plugin(k, parent, "bsdf", "dielectric", NULL, material->line);
	} else if (model == 5 || model == 8) {
		struct xml_element *mirror = add_plugin(k, parent, "bsdf", "conductor", NULL, material->line);
		add_property(k, mirror, "string", "material", &(struct mtl_value){material->line, "Al"});
	} else {
		struct xml_element *diffuse = add_plugin(k, parent, "bsdf", "diffuse", NULL, material->line);
		add_colour(k, diffuse, "reflectance", material->line, &material->diffuse, &material->diffuse_map);
	}
}

int mtl_add_bsdf(const struct mtl *m, const struct mtl_material *material, struct xml_element *shape,
		 struct arena *arena)
{
	struct element_builder k = {.mtl = m, .arena = arena};
	struct xml_element *parent = shape;
	double opacity = 1;
	bool has_opacity_map = material->opacity_map.line > material->opacity.line;
	bool has_opacity = material->opacity.line && !(number_parse(material->opacity.text, &opacity) && opacity == 1);
	if (has_opacity_map || has_opacity) {
		parent = add_plugin(&k, parent, "bsdf", "mask", NULL, material->line);
		if (has_opacity_map)
			add_bitmap(&k, parent, "opacity", &material->opacity_map, false);
		else
			add_property(&k, parent, "float", "opacity", &material->opacity);
	}
	if (material->bump.line) {
		parent = add_plugin(&k, parent, "bsdf", "bumpmap", NULL, material->line);
		add_bitmap(&k, parent, NULL, &material->bump, true);
	}
	add_bsdf(&k, material, parent);
	return k.count;
}
