/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What takes the place of things that are not supported or missing, with --lenient (lenient.h says what), and the notes
 * that say so. Each returns 0, REPORT_TOLD where nothing is left in its place, or another error. One thread.
 */
#ifndef WORKER_RENDER_SCENE_SUBSTITUTE_H
#define WORKER_RENDER_SCENE_SUBSTITUTE_H

#include "worker/render/scene/lenient.h"
#include "worker/render/scene/notes.h"

/* A plug-in that no table has: *type and *decl become those of its replacement, or *inner the BSDF inside it. Refused
 * where there is neither. */
int substitute_plugin(const struct notes *t, const struct plugin_decl *decls, struct id_table *ids,
		      const struct xml_element *el, enum plugin_class cls, const char **type,
		      const struct plugin_decl **decl, struct xml_element **inner);

/* What needs a file that the scene does not come with: a texture is left out (REPORT_TOLD), and a material becomes
 * another one. */
int substitute_lost(const struct notes *t, const struct asset_source *assets, const struct plugin_decl *decls,
		    const struct xml_element *el, const char **type, const struct plugin_decl **decl);

/* *node becomes the BSDF inside it if it does not allow that, or if it `lacks` the texture that it needs. */
int substitute_cover(const struct notes *t, const struct xml_element *el, bool lacks, const struct scene_node **node);

/* A medium that `lacks` something that was left out, such as its density, goes, too. */
int substitute_medium(const struct notes *t, const struct xml_element *el, bool lacks, const struct scene_node *node);

/* In 0.6, a constant volume without its value is removed, and so is the medium that uses it. */
int substitute_volume(const struct notes *t, const struct xml_element *el, const struct scene_node *node);

#endif
