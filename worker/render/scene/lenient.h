/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Replacements for what is not supported or missing, with --lenient. The reader notes whatever is replaced or left
 * out. Any thread; only lenient_missing opens files.
 */
#ifndef WORKER_RENDER_SCENE_LENIENT_H
#define WORKER_RENDER_SCENE_LENIENT_H

#include "worker/render/asset/asset.h"
#include "worker/render/scene/id_table.h"
#include "worker/render/scene/node.h"
#include "worker/render/plugin/param.h"

#include <stdbool.h>

enum lenient_way {
	LENIENT_REFUSE,	   /* no replacement: most sensors */
	LENIENT_LEAVE_OUT, /* a medium, a shape, an emitter, a texture (the parameter keeps its default) */
	LENIENT_REPLACE,   /* by *stand_in of the same class */
	/* By the one of its class inside; otherwise as LENIENT_REPLACE or, without a stand-in, LENIENT_LEAVE_OUT. */
	LENIENT_INNER,
};

/* For a plug-in that no table has. */
enum lenient_way lenient_plugin(enum plugin_class cls, const char *type, const char **stand_in);

/* The same for such an element, by what is inside it: a light in a shape becomes an `area`, a shape with the file of a
 * mesh that mesh, a sensor the one whose name is part of its own, and a material one that has such parameters. */
enum lenient_way lenient_element(const struct xml_element *el, enum plugin_class cls, const char *type,
				 const char **stand_in);

/* The replacement's parameter that corresponds to `name` of the plug-in replaced; `name` itself if there is none. */
const char *lenient_param(const char *stand_in, const char *name);

/* Whether the replacement's parameter `name` goes because another in the `owner` that is replaced says the same. */
bool lenient_says_again(const char *stand_in, const char *name, const struct xml_element *owner);

/* The parameter that `name` is in 0.6, for files of 3.x; stands_in: d replaces the plug-in that has it. NULL: none, or
 * the object of the element `el` has it by its own name too, or by this one before. */
const struct param *lenient_old_param(const struct plugin_decl *d, bool stands_in, const struct xml_element *el,
				      const char *name);

/* The BSDF inside `n` if `n` may only hold opaque ones and holds one that transmits light; NULL: nothing is wrong. */
const struct scene_node *lenient_uncovered(const struct scene_node *n);

/* An object that is nothing without the texture inside it. */
bool lenient_needs_texture(const char *type);

/* After a sentence that says that a texture's file is missing. */
#define LENIENT_TEXTURE_HINT "; --lenient leaves the texture out"
const char *lenient_texture_hint(const char *sentence); /* without the semicolon where that is a question */

/* The file of a texture or a measured material that the scene does not come with: it is missing, or its name begins
 * at the root, from which nothing is read. NULL: it is there, or outside the folders that may be read, or it is another
 * kind of object, or it needs no file. Textures of old scenes are often lost; a mesh, or an environment, has no
 * replacement. */
const char *lenient_missing(const struct asset_source *assets, const struct xml_element *el);

/* The first object of the class `wanted` inside one of it that is not supported, of BSDFs rather one that is not clear;
 * NULL: none. */
struct xml_element *lenient_inner(struct id_table *ids, const struct xml_element *el, enum plugin_class wanted);

#endif
