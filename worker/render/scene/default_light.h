/* SPDX-License-Identifier: Apache-2.0 */
/* The light of a scene without emitters. One thread. */
#ifndef WORKER_RENDER_SCENE_DEFAULT_LIGHT_H
#define WORKER_RENDER_SCENE_DEFAULT_LIGHT_H

#include "worker/render/scene/param.h"
#include "worker/render/scene/xml.h"

/* Adds the sun and sky of Mitsuba 0.5 and 0.6 to a file of theirs that has shapes and no emitter, with a note. False:
 * out of memory. decls: where these are not known nothing is added. */
bool default_light_add(struct xml_tree *t, const struct plugin_decl *decls, struct arena *arena);

#endif
