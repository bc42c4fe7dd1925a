/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Turns the tree of XML elements (or glTF read as such) into a tree of typed nodes, using the tables of the plug-ins.
 *
 * Happy path: read_description parses the file. make_scene lists all ids and walks over the top level, and maker.c
 * makes a node of each object there, with everything inside it. list_assets collects the names of all files.
 *
 * Failures: a problem is reported with file and line and reading goes on, so that one run finds all problems
 * (report.h). scene_read fails with the first problem; scene_read_all returns all of them. -ENOMEM ends the reading.
 */
#include "worker/render/scene/scene.h"

#include "worker/render/scene/maker.h"
#include "worker/render/scene/asset_list.h"
#include "worker/render/scene/batch.h"
#include "worker/render/xml/element.h"
#include "worker/render/xml/element_make.h"
#include "worker/render/gltf/gltf.h"
#include "worker/render/scene/id_table.h"
#include "worker/render/scene/integrators.h"
#include "worker/render/scene/nesting.h"
#include "worker/render/scene/notes.h"
#include "worker/render/scene/obj_materials.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/scene/difference_notes.h"
#include "worker/render/scene/report.h"
#include "worker/render/scene/subsurface.h"
#include "worker/render/scene/texture_names.h"
#include "worker/render/xml/upgrade.h"
#include "worker/render/scene/value.h"
#include "worker/render/xml/xml.h"

#include <string.h>

static int make_object(struct maker *m, struct xml_element *el, const struct scene_node **out)
{
	int r = maker_make_node(m, el, out);
	if (!r)
		r = nesting_add_to_scene(&m->object_count, el, m->error);
	uint32_t count = 1;
	if (!r && node_is_batch(*out))
		r = batch_expand(*out, m->arena, out, &count, m->error);
	m->scene->object_count += r ? 0 : count;
	return r;
}

static int read_top_level(struct maker *m, const struct xml_element *container, const struct scene_node **objects);

static int read_include(struct maker *m, const struct xml_element *el, const struct scene_node **objects)
{
	int r = el->is_unset ? REPORT_ALREADY_REPORTED : element_check_contents(el, "filename", true, m->error);
	return r ? r : read_top_level(m, strcmp(el->first_child->name, "scene") == 0 ? el->first_child : el, objects);
}

/* Returns whether a value directly in <scene>, in 3.x, has no meaning: it is not a spectrum that others refer to,
 * nor a plug-in's parameter in the wrong place. In 0.6 no such value has a meaning. */
static bool is_foreign_value(const struct maker *m, const struct xml_element *el)
{
	const char *name = xml_attribute_value(el, "name");
	return name && !id_table_can_name(el) && !plugin_any_has_param(m->decls, name);
}

/* Reads an element that is directly in <scene>, or the only one of a file included there. */
static int read_top_element(struct maker *m, struct xml_element *el, const struct scene_node **objects)
{
	enum plugin_class cls;
	if (el->is_ignored)
		return note_ignored_element(&m->notes, el);
	if (plugin_is_sampling_hint(el->name, xml_attribute_value(el, "type")))
		return note_guide(&m->notes, el);
	if (plugin_class_find(el->name, &cls))
		return make_object(m, el, &objects[m->scene->object_count]);
	if (strcmp(el->name, "include") == 0)
		return read_include(m, el, objects);
	if (strcmp(el->name, "default") == 0)
		return element_check_contents(el, "name|value", false, m->error);
	if (strcmp(el->name, "path") == 0)
		return element_check_contents(el, "value", false, m->error);
	if (value_is_element(el->name) && (el->is_camel_case || is_foreign_value(m, el)))
		return note_ignored_element(&m->notes, el);
	if (el->is_unset)
		return 0;
	struct value unused;
	if (id_table_can_name(el) && value_is_element(el->name)) /* a spectrum: each reference to it makes a copy */
		return value_read(el, m->asset_source, m->arena, &unused, m->error);
	return strcmp(el->name, "alias") == 0 ? 0 : maker_reject_element(m, el);
}

static int read_top_level(struct maker *m, const struct xml_element *container, const struct scene_node **objects)
{
	int r = strcmp(container->name, "scene") == 0 ? element_check_contents(container, "version", true, m->error)
						      : 0;
	r = report_problem(&m->report, r, m->error);
	for (struct xml_element *el = container->first_child; el && !r; el = el->next_sibling)
		r = report_problem(&m->report, read_top_element(m, el, objects), m->error);
	return r;
}

static int list_assets(struct maker *m)
{
	for (uint32_t i = 0; i < m->tree->include_count; i++) {
		int r = maker_add_asset(m, m->tree->included_files[i], NULL);
		if (r)
			return r;
	}
	if (asset_list_finish(&m->assets, m->name, m->arena))
		return maker_out_of_memory(m);
	m->scene->asset_places = m->assets.places;
	m->scene->assets = m->assets.names;
	m->scene->asset_count = (uint32_t)m->assets.count;
	return 0;
}

static bool has_descendant(const struct xml_element *container, const char *name)
{
	for (const struct xml_element *el = container->first_child; el; el = el->next_sibling)
		if (!el->is_ignored && (strcmp(el->name, name) == 0 || has_descendant(el, name)))
			return true;
	return false;
}

/* Adds the default light. It is not meant to be realistic: the sun is large, and the sky extends below the horizon,
 * so that any model can be seen. */
static bool make_daylight(struct xml_element *scene, struct arena *arena)
{
	struct xml_element *light = element_make(scene, "emitter", scene->file, scene->line, arena), *transform,
			   *rotation;
	if (!light)
		return false;
	element_add_attribute(light, "type", "sunsky");
	if (!element_add_parameter(light, "float", "scale", "2", arena) ||
	    !element_add_parameter(light, "boolean", "extend", "true", arena) ||
	    !element_add_parameter(light, "float", "sun_radius_scale", "15", arena) ||
	    !(transform = element_make(light, "transform", scene->file, scene->line, arena)) ||
	    !(rotation = element_make(transform, "rotate", scene->file, scene->line, arena)))
		return false;
	element_add_attribute(transform, "name", "to_world");
	element_add_attribute(rotation, "y", "1");
	element_add_attribute(rotation, "angle", "-120");
	return true;
}

/* Adds the default sun and sky of Mitsuba 0.5 and 0.6 to a scene in their format that has shapes but no emitter,
 * with a note. Adds nothing if decls has no sunsky. Returns false if out of memory. */
static bool add_default_light(struct xml_tree *t, const struct plugin_decl *decls, struct arena *arena)
{
	if (t->is_dialect_3 || t->has_missing_files || has_descendant(t->root, "emitter") ||
	    !has_descendant(t->root, "shape") || t->note_count >= XML_NOTES_MAX ||
	    !plugin_find(decls, PLUGIN_EMITTER, "sunsky"))
		return true;
	t->notes[t->note_count++] = "has no emitter: sun and sky are added, as by Mitsuba 0.6";
	t->element_count++;
	return make_daylight(t->root, arena);
}

/* Notes, in one sentence, all shapes that --lenient leaves out because their transforms have no inverse. */
static int note_flat_shapes(const struct maker *m)
{
	const struct xml_element *first = m->first_flat_shape;
	return !first ? 0
		      : note_add(
				&m->notes, first, "", "flat",
				"%u shape%s that to_world flattens (it has no inverse) %s left out (lenient; first: the %.64s in %s:%d)",
				m->flat_shape_count, m->flat_shape_count == 1 ? "" : "s",
				m->flat_shape_count == 1 ? "is" : "are", xml_attribute_value(first, "type"),
				first->file, first->line);
}

static int make_scene(struct maker *m)
{
	struct scene *s = m->scene;
	const struct scene_node **objects = add_default_light(m->tree, m->decls, &s->arena)
						    ? arena_alloc(m->arena, m->tree->element_count, sizeof *objects)
						    : NULL;
	if (!objects)
		return maker_out_of_memory(m);
	s->is_dialect_3 = m->tree->is_dialect_3;
	s->has_black_backs = m->tree->has_black_backs;
	s->objects = objects;
	texture_names_normalize(m->decls, m->tree->root);
	upgrade_prerelease_names(m->tree->root);
	int r = relief_files_to_textures(m->tree->root, m->arena, m->error);
	if (!r)
		r = id_table_build(&m->ids, m->tree, m->arena, &m->report, m->error);
	if (!r)
		r = texture_names_resolve_references(m->tree->root, &m->ids, m->arena, m->error);
	if (!r && m->is_lenient)
		r = subsurface_replace_dipoles(m);
	if (!r)
		r = obj_materials_split(m->tree, &m->ids, m->asset_source, &m->assets, m->arena, &m->report, m->error);
	if (!r)
		r = read_top_level(m, m->tree->root, objects);
	for (uint32_t i = 0; i < s->object_count; i++)
		s->lacks_media |=
			objects[i]->cls == PLUGIN_INTEGRATOR && integrator_find_without_media(objects[i]) != NULL;
	for (uint32_t i = 0; i < m->tree->note_count && !r; i++)
		r = note_add(&m->notes, m->tree->root, m->tree->notes[i], "", "%s: %s", m->name, m->tree->notes[i]);
	if (!r)
		r = note_flat_shapes(m);
	if (!r && !m->tree->has_missing_files)
		r = note_scene_differences(objects, s->object_count, s->is_dialect_3, &m->report, m->error);
	return r ? r : list_assets(m);
}

/* Reports names without a value and missing files. */
static int report_missing(struct maker *m)
{
	int r = 0;
	struct error e;
	for (uint32_t i = 0; i < m->tree->missing_count && !r; i++)
		r = report_problem(&m->report, error_set(&e, EINVAL, "%s", m->tree->missing[i]), &e);
	if (r)
		*m->error = e;
	return r;
}

/* Reads as much as possible; problems are collected in s->problems. */
static int read_description(struct scene *s, const struct asset_source *assets, const char *name,
			    const struct plugin_decl *decls, const struct scene_define *defines, size_t define_count,
			    bool lenient, struct maker *m)
{
	*s = (struct scene){.arena.limit = XML_MEMORY_MAX};
	*m = (struct maker){.scene = s,
			    .arena = &s->arena,
			    .asset_source = assets,
			    .decls = decls,
			    .error = m->error,
			    .is_lenient = lenient};
	m->notes = (struct notes){.report = &m->report, .error = m->error};
	m->tree = arena_alloc(m->arena, 1, sizeof *m->tree);
	s->file = arena_strdup(&s->arena, name);
	int r = m->tree && s->file ? report_init(&m->report, &s->arena, m->error) : maker_out_of_memory(m);
	if (r)
		return r;
	m->name = name;
	if (gltf_is_file_name(name))
		r = define_count ? error_set(m->error, EINVAL, "%s: a glTF file has no names to define", name)
				 : gltf_read(m->tree, assets, name, &s->arena, m->error);
	else
		r = xml_read(m->tree, assets, name, defines, define_count, &s->arena, m->error);
	int missing_rc = report_missing(m); /* also if reading ended early */
	if (missing_rc)
		r = missing_rc;
	else if (r)
		r = report_problem(&m->report, r, m->error);
	else if (!m->tree->has_unset_path && (r = make_scene(m)) == REPORT_FULL)
		r = 0;
	s->notes = m->report.notes;
	s->note_count = m->report.note_count;
	s->problems = m->report.problems;
	s->problem_count = m->report.problem_count;
	s->flawed = m->flawed;
	s->flawed_count = m->flawed_count;
	return r;
}

int scene_read_all(struct scene *s, const struct asset_source *assets, const char *name,
		   const struct plugin_decl *decls, const struct scene_define *defines, size_t define_count,
		   bool lenient, struct error *e)
{
	struct maker m = {.error = e};
	int r = read_description(s, assets, name, decls, defines, define_count, lenient, &m);
	if (r)
		scene_fini(s);
	return r;
}

/* Returns the number of files that cannot be opened; they are not problems of the description itself. */
static uint32_t count_missing_files(const struct scene *s, const struct asset_source *assets)
{
	uint32_t missing = 0;
	for (uint32_t i = 0; i < s->asset_count; i++) {
		struct asset a;
		struct error unused;
		if (assets->open(assets->user, s->assets[i], &a, &unused))
			missing++;
		else
			assets->close(assets->user, &a);
	}
	return missing;
}

static void append_problem_count(uint32_t more, int code, struct error *e)
{
	struct error first;
	if (!e || more == 0)
		return;
	first = *e;
	error_set(e, -code, "%.900s (and at least %u more: hslt-scene check lists all)", first.text, more);
}

int scene_append_missing_count(const struct scene *s, const struct asset_source *assets, int code, struct error *e)
{
	uint32_t missing = code == -ENOENT ? count_missing_files(s, assets) : 0;
	append_problem_count(missing ? missing - 1 : 0, code, e);
	return code;
}

static int read_or_fail(struct scene *s, const struct asset_source *assets, const char *name,
			const struct plugin_decl *decls, const struct scene_define *defines, size_t define_count,
			bool lenient, struct error *e)
{
	struct error unused;
	struct maker m = {.error = e ? e : &unused};
	int r = read_description(s, assets, name, decls, defines, define_count, lenient, &m);
	if (!r && s->problem_count > 0) {
		r = m.report.first_code;
		uint32_t more = s->problem_count - 1 + count_missing_files(s, assets);
		if (e)
			*e = m.report.first_error;
		append_problem_count(more, r, e);
	}
	if (r)
		scene_fini(s);
	return r;
}

int scene_read(struct scene *s, const struct asset_source *assets, const char *name, const struct plugin_decl *decls,
	       const struct scene_define *defines, size_t define_count, struct error *e)
{
	return read_or_fail(s, assets, name, decls, defines, define_count, false, e);
}

int scene_read_lenient(struct scene *s, const struct asset_source *assets, const char *name,
		       const struct plugin_decl *decls, const struct scene_define *defines, size_t define_count,
		       struct error *e)
{
	return read_or_fail(s, assets, name, decls, defines, define_count, true, e);
}

void scene_fini(struct scene *s)
{
	arena_fini(&s->arena);
	*s = (struct scene){0};
}
