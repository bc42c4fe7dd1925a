/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads a glTF 2.0 scene (.gltf, .glb) into the tree of elements of an equivalent XML file of version 3, so that
 * everything after it (tables of parameters, refusals and replacements, the list of files) is shared. Geometry stays in
 * its buffers, which shapes of type "gltf" read. One thread; the tree is allocated in the given arena.
 */
#ifndef WORKER_RENDER_GLTF_GLTF_H
#define WORKER_RENDER_GLTF_GLTF_H

#include "worker/render/xml/xml.h"

/* Returns whether the name ends in .gltf or .glb. */
bool gltf_is_file_name(const char *name);

int gltf_read(struct xml_tree *t, const struct asset_source *assets, const char *name, struct arena *arena,
	      struct error *e);

#endif
