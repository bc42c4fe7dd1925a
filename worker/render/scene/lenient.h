/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Replacements, with --lenient, for what is unsupported or missing. The reader notes everything that is replaced or
 * left out. Any thread; only lenient_missing_file() opens files.
 */
#ifndef WORKER_RENDER_SCENE_LENIENT_H
#define WORKER_RENDER_SCENE_LENIENT_H

#include "worker/render/asset/asset.h"
#include "worker/render/scene/id_table.h"
#include "worker/render/scene/node.h"
#include "worker/render/plugin/param.h"

#include <stdbool.h>

enum lenient_action {
	LENIENT_REFUSE,	   /* no replacement: most sensors */
	LENIENT_LEAVE_OUT, /* media, shapes, emitters, textures (the parameter keeps its default) */
	LENIENT_REPLACE,   /* use the plug-in *stand_in of the same class */
	/* Use the object of the same class inside it; if there is none, as LENIENT_REPLACE or, without a stand-in, as
	   LENIENT_LEAVE_OUT. */
	LENIENT_INNER,
};

/* Returns what to do about a plug-in that is in no table, judging by its type. */
enum lenient_action lenient_plugin_action(enum plugin_class cls, const char *type, const char **stand_in);

/* Like lenient_plugin_action(), but judges by the element's contents as well: an emitter in a shape becomes an `area`,
 * a shape with a mesh file that mesh, a sensor the camera whose name is part of its type, and a material the one that
 * has such parameters. */
enum lenient_action lenient_element_action(const struct xml_element *el, enum plugin_class cls, const char *type,
					   const char **stand_in);

/* Returns the stand-in's parameter that corresponds to the replaced plug-in's `name`; `name` itself if none is
 * known. */
const char *lenient_param_name(const char *stand_in, const char *name);

/* Returns whether the stand-in's parameter `name` is dropped because another parameter of the replaced object,
 * `owner`, says the same. */
bool lenient_is_redundant_param(const char *stand_in, const char *name, const struct xml_element *owner);

/* Returns the parameter that `name` means: as 0.6 writes it in a file of 3.x, or as forks write it in any file.
 * is_stand_in: d replaces the plug-in of the object. NULL if there is none, or if the object of the element `el` is
 * also given it by its own name, or earlier by this one. */
const struct param *lenient_old_param(const struct plugin_decl *d, bool is_stand_in, const struct xml_element *el,
				      const char *name);

/* Returns the BSDF inside `n` if `n` may hold opaque BSDFs only and this one transmits light; NULL if nothing is
 * wrong. */
const struct scene_node *lenient_transmissive_inner(const struct scene_node *n);

/* Returns whether an object of this type is useless without the texture inside it. */
bool lenient_needs_texture(const char *type);

/* Appended to a sentence that says that a texture's file is missing. */
#define LENIENT_TEXTURE_HINT "; --lenient leaves the texture out"
const char *lenient_texture_hint(const char *sentence); /* without the semicolon if the sentence is a question */

/* Returns the file of a texture or a measured material that does not come with the scene: it is missing, or its
 * absolute path cannot be read. NULL if the file is there or outside the folders that may be read, or if the object is
 * of another kind or needs no file. Textures of old scenes are often lost; meshes and environments have no
 * replacement. */
const char *lenient_missing_file(const struct asset_source *assets, const struct xml_element *el);

/* Returns the first object of the class `wanted` inside an object that is not supported; of BSDFs, preferably one
 * that is not a clear coat. NULL if there is none. */
struct xml_element *lenient_find_inner(struct id_table *ids, const struct xml_element *el, enum plugin_class wanted);

#endif
