/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes the replacements of --lenient for what is unsupported or missing (lenient.h decides which), and notes them.
 * Each function returns 0, REPORT_ALREADY_REPORTED if the object is left out, or another error. One thread.
 */
#ifndef WORKER_RENDER_SCENE_SUBSTITUTE_H
#define WORKER_RENDER_SCENE_SUBSTITUTE_H

#include "worker/render/scene/lenient.h"
#include "worker/render/scene/notes.h"

/* For a plug-in that is in no table: *type and *decl become those of its replacement, or *inner becomes the object
 * of its class inside it. The plug-in is refused if there is neither. */
int substitute_plugin(const struct notes *t, const struct plugin_decl *decls, struct id_table *ids,
		      const struct xml_element *el, enum plugin_class cls, const char **type,
		      const struct plugin_decl **decl, struct xml_element **inner);

/* For an object whose file does not come with the scene: a texture is left out (REPORT_ALREADY_REPORTED), and a
 * material becomes another one. */
int substitute_missing_file(const struct notes *t, const struct asset_source *assets, const struct plugin_decl *decls,
			    const struct xml_element *el, const char **type, const struct plugin_decl **decl);

/* Sets *node to the BSDF inside it if *node does not allow that BSDF, or if it `lacks_content` the texture that it
 * needs. */
int substitute_cover(const struct notes *t, const struct xml_element *el, bool lacks_content,
		     const struct scene_node **node);

/* Leaves out a medium that `lacks_content` something, such as its density. */
int substitute_medium(const struct notes *t, const struct xml_element *el, bool lacks_content,
		      const struct scene_node *node);

/* Leaves out a constant volume of 0.6 without a value, and with it the medium that uses it. */
int substitute_volume(const struct notes *t, const struct xml_element *el, const struct scene_node *node);

#endif
