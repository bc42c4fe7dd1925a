/* SPDX-License-Identifier: Apache-2.0 */
/* Gives one name to what 3.x allows to be written as a texture or as a spectrum: there, a spectrum is a texture of
 * one colour. */
#ifndef WORKER_RENDER_SCENE_TEXTURE_NAMES_H
#define WORKER_RENDER_SCENE_TEXTURE_NAMES_H

#include "worker/render/scene/id_table.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/xml/xml.h"

/* In the whole tree, turns <spectrum type="bitmap"> and the like into a <texture>, and <texture type="uniform"> and
 * the like into a <spectrum>. */
void texture_names_normalize(const struct plugin_decl *decls, struct xml_element *root);

/* Turns each <ref> to a spectrum that is an object, such as <spectrum type="blackbody" id="lamp">, into that
 * spectrum. Returns 0, -E2BIG if references make too much of it, or -ENOMEM. */
int texture_names_resolve_references(struct xml_element *root, struct id_table *ids, struct arena *arena,
				     struct error *e);

/* In the whole tree, turns <string name="filename" value="x.png"/> directly inside a `bumpmap` or `normalmap`, as
 * forks of Mitsuba have it, into a <texture type="bitmap"> of that file whose numbers are not decoded. Returns 0 or
 * -ENOMEM. */
int relief_files_to_textures(struct xml_element *root, struct arena *arena, struct error *e);

#endif
