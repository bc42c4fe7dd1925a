/* SPDX-License-Identifier: Apache-2.0 */
/* One name for what 3.x lets a file write as a texture or as a spectrum: there, a spectrum is a texture of one colour.
 */
#ifndef WORKER_RENDER_SCENE_TEXTURE_NAMES_H
#define WORKER_RENDER_SCENE_TEXTURE_NAMES_H

#include "worker/render/scene/id_table.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/xml/xml.h"

/* <spectrum type="bitmap"> becomes a <texture>, <texture type="uniform"> a <spectrum>, in all of the tree. */
void texture_names_settle(const struct plugin_decl *decls, struct xml_element *root);

/* A <ref> to a spectrum that is an object, <spectrum type="blackbody" id="lamp">, becomes that spectrum.
 * -E2BIG: references make too much of it; -ENOMEM. */
int texture_names_follow(struct xml_element *root, struct id_table *ids, struct arena *arena, struct error *e);

/* As in forks of Mitsuba: <string name="filename" value="x.png"/> directly in a `bumpmap` or `normalmap` becomes a
 * <texture type="bitmap"> of that file whose numbers are not decoded, in all of the tree. 0 or -ENOMEM. */
int relief_files_settle(struct xml_element *root, struct arena *arena, struct error *e);

#endif
