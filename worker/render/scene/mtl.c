/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads .mtl files and makes scene elements of their materials.
 *
 * mtl_read reads a file line by line. `newmtl` begins a material, a keyword of the table sets one of its values, and of
 * several values the last one counts. mtl_put writes a material as elements: a mask if it is not opaque, inside it a
 * bumpmap if there is one, inside that the BSDF that `illum` selects. The elements are then read like those of the
 * scene file, so values that are not numbers are reported there, with the line in the .mtl file.
 *
 * A file that cannot be opened has no materials. A keyword that would change the image but is not supported is stored
 * in mtl.unread, for the caller to report. Too many materials give -E2BIG, lack of memory -ENOMEM.
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

static const char *name_beside(const char *other, const char *name, struct arena *arena)
{
	const char *slash = *name != '/' ? strrchr(other, '/') : NULL;
	size_t folder = slash ? (size_t)(slash - other) + 1 : 0, size = folder + strlen(name);
	char *joined = arena_alloc(arena, size + 1, 1), *out = arena_alloc(arena, ASSET_NAME_ROOM(size), 1);
	if (!joined || !out)
		return NULL;
	snprintf(joined, size + 1, "%.*s%s", (int)folder, other, name);
	asset_name_canonical(joined, out);
	return out;
}

static char *copy(const char *text, size_t length, struct arena *arena)
{
	char *out = arena_alloc(arena, length + 1, 1);
	if (out) {
		memcpy(out, text, length);
		out[length] = 0;
	}
	return out;
}

const char *mtl_file(const struct asset_source *assets, const char *other, const char *name, size_t length,
		     struct arena *arena)
{
	char *written = copy(name, length, arena);
	if (!written)
		return NULL;
	for (char *p = written; *p; p++)
		*p = *p == '\\' ? '/' : *p; /* as written on Windows */
	const char *last = strrchr(written, '/'), *out = name_beside(other, written, arena);
	return !out || !last || can_open(assets, out) ? out : name_beside(other, last + 1, arena);
}

/* ---- reading */

static const struct keyword {
	const char *word;
	size_t at; /* offset of the mtl_value in struct mtl_material */
	bool file;
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
static const char *const unread[] = {"Ke",	 "map_Ke", "Tr",       "Tf",	 "map_Ns", "map_bump",
				     "map_Bump", "norm",   "disp",     "Pr",	 "Pm",	   "map_Pr",
				     "map_Pm",	 "refl",   "map_refl", "map_Tr", "decal",  NULL};

static size_t without_comment(const struct text_line *l)
{
	const char *hash = memchr(l->rest, '#', l->rest_length);
	return hash ? (size_t)(hash - l->rest) : l->rest_length;
}

static int read_value(struct mtl *m, struct mtl_material *into, const struct text_line *l,
		      const struct asset_source *assets, struct arena *arena)
{
	for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++) {
		if (!text_line_is(l, keywords[i].word))
			continue;
		struct mtl_value v = {.line = l->number};
		if (keywords[i].file)
			v.text = mtl_file(assets, m->file, l->rest, l->rest_length, arena);
		else
			v.text = copy(l->rest, without_comment(l), arena);
		if (!v.text)
			return -ENOMEM;
		memcpy((char *)into + keywords[i].at, &v, sizeof v);
		return 0;
	}
	for (size_t i = 0; unread[i] && !m->unread.line; i++)
		if (text_line_is(l, unread[i]))
			m->unread = (struct mtl_value){l->number, unread[i]};
	return 0;
}

static int read_lines(struct mtl *m, struct text_lines *lines, const struct asset_source *assets, struct arena *arena,
		      struct error *e)
{
	struct mtl_material *now = NULL;
	int r = 0, count = 0;
	for (struct text_line l; !r && text_lines_next(lines, &l);) {
		if (text_line_is(&l, "newmtl")) {
			if (++count > MTL_MATERIALS_MAX)
				return error_set(e, E2BIG, "%s:%d: more than %d materials", m->file, l.number,
						 MTL_MATERIALS_MAX);
			now = arena_alloc(arena, 1, sizeof *now);
			if (!now)
				break;
			*now = (struct mtl_material){
				.name = copy(l.rest, l.rest_length, arena), .line = l.number, .before = m->last};
			m->last = now;
			r = now->name ? 0 : -ENOMEM;
		} else if (now) {
			r = read_value(m, now, &l, assets, arena);
		}
	}
	return r || (count && !now) ? error_set(e, ENOMEM, "%s: out of memory", m->file) : 0;
}

int mtl_read(struct mtl *m, const struct asset_source *assets, const char *file, struct arena *arena, struct error *e)
{
	*m = (struct mtl){.file = file};
	struct asset a;
	struct error unused;
	if (assets->open(assets->user, file, &a, &unused))
		return 0;
	m->there = true;
	struct text_lines lines = {.p = (const char *)a.bytes, .end = (const char *)a.bytes + a.size};
	int r = read_lines(m, &lines, assets, arena, e);
	assets->close(assets->user, &a);
	return r;
}

const struct mtl_material *mtl_find(const struct mtl *m, const char *name)
{
	const struct mtl_material *of = m->last;
	while (of && strcmp(of->name, name) != 0)
		of = of->before;
	return of;
}

/* ---- elements */

struct element_builder {
	const struct mtl *m;
	struct arena *arena;
	int count; /* number of elements made; negative: out of memory */
};

static struct xml_element *make_element(struct element_builder *k, struct xml_element *in, const char *element,
					int line)
{
	struct xml_element *el = k->count < 0 ? NULL : element_make(in, element, k->m->file, line, k->arena);
	k->count = el ? k->count + 1 : -ENOMEM;
	return el;
}

static struct xml_element *plugin(struct element_builder *k, struct xml_element *in, const char *cls, const char *type,
				  const char *name, int line)
{
	struct xml_element *el = make_element(k, in, cls, line);
	if (el)
		element_put(el, "type", type);
	if (el && name)
		element_put(el, "name", name);
	return el;
}

static void property(struct element_builder *k, struct xml_element *in, const char *element, const char *name,
		     const struct mtl_value *v)
{
	struct xml_element *el = make_element(k, in, element, v->line);
	if (el) {
		element_put(el, "name", name);
		element_put(el, "value", v->text);
	}
}

static void put_picture(struct element_builder *k, struct xml_element *in, const char *name, const struct mtl_value *v,
			bool numbers)
{
	struct xml_element *texture = plugin(k, in, "texture", "bitmap", name, v->line);
	property(k, texture, "string", "filename", v);
	if (numbers)
		property(k, texture, "float", "gamma", &(struct mtl_value){v->line, "1"});
}

/* Puts a colour, in sRGB as in Mitsuba, or an image, whichever is given last. */
static void colour(struct element_builder *k, struct xml_element *in, const char *name, int line,
		   const struct mtl_value *v, const struct mtl_value *map)
{
	if (map->line > v->line)
		put_picture(k, in, name, map, false);
	else
		property(k, in, "srgb", name, v->line ? v : &(struct mtl_value){line, "0 0 0"});
}

static bool is_zero(const struct mtl_value *v)
{
	double x[3] = {0};
	int n = v->line ? number_list(v->text, x, 3) : 3;
	return n >= 0 && x[0] == 0 && x[1] == 0 && x[2] == 0;
}

static void put_lobes(struct element_builder *k, const struct mtl_material *of, struct xml_element *in)
{
	int64_t model = 0;
	if (of->model.line && !number_parse_int(of->model.text, &model))
		model = 0;
	bool shines = of->specular_map.line > of->specular.line || !is_zero(&of->specular);
	if (model == 2 && shines && !is_zero(&of->exponent)) {
		struct xml_element *phong = plugin(k, in, "bsdf", "phong", NULL, of->line);
		colour(k, phong, "diffuse_reflectance", of->line, &of->diffuse, &of->diffuse_map);
		colour(k, phong, "specular_reflectance", of->line, &of->specular, &of->specular_map);
		property(k, phong, "float", "exponent", &of->exponent);
	} else if (model == 4 || model == 6 || model == 7 || model == 9) {
		plugin(k, in, "bsdf", "dielectric", NULL, of->line);
	} else if (model == 5 || model == 8) {
		struct xml_element *mirror = plugin(k, in, "bsdf", "conductor", NULL, of->line);
		property(k, mirror, "string", "material", &(struct mtl_value){of->line, "Al"});
	} else {
		struct xml_element *diffuse = plugin(k, in, "bsdf", "diffuse", NULL, of->line);
		colour(k, diffuse, "reflectance", of->line, &of->diffuse, &of->diffuse_map);
	}
}

int mtl_put(const struct mtl *m, const struct mtl_material *of, struct xml_element *shape, struct arena *arena)
{
	struct element_builder k = {.m = m, .arena = arena};
	struct xml_element *in = shape;
	double opacity = 1;
	bool mapped = of->opacity_map.line > of->opacity.line;
	bool partly = of->opacity.line && !(number_parse(of->opacity.text, &opacity) && opacity == 1);
	if (mapped || partly) {
		in = plugin(&k, in, "bsdf", "mask", NULL, of->line);
		if (mapped)
			put_picture(&k, in, "opacity", &of->opacity_map, false);
		else
			property(&k, in, "float", "opacity", &of->opacity);
	}
	if (of->bump.line) {
		in = plugin(&k, in, "bsdf", "bumpmap", NULL, of->line);
		put_picture(&k, in, NULL, &of->bump, true);
	}
	put_lobes(&k, of, in);
	return k.count;
}
