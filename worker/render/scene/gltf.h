/* SPDX-License-Identifier: Apache-2.0 */
/*
 * glTF 2.0 scenes (.gltf, .glb) as the tree of elements that an XML file of version 3 would be: all that follows
 * (tables of parameters, what is refused or left out, the list of files) is one for both. Geometry stays in its
 * buffers, which shapes of type "gltf" read. One thread; the tree lives in the arena given.
 */
#ifndef WORKER_RENDER_SCENE_GLTF_H
#define WORKER_RENDER_SCENE_GLTF_H

#include "worker/render/scene/xml.h"

/* By the end of its name. */
bool gltf_is(const char *name);

int gltf_read(struct xml_tree *t, const struct asset_source *assets, const char *name, struct arena *arena,
	      struct error *e);

#endif
