/* SPDX-License-Identifier: Apache-2.0 */
/* Materials. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_MATERIAL_H
#define WORKER_RENDER_GLTF_GLTF_MATERIAL_H

#include "worker/render/gltf/gltf_tree.h"

/* Which vertex attributes of a primitive multiply the material: none, its colours, or its colours and alpha. */
enum gltf_vertex_colours { GLTF_NO_COLOURS, GLTF_COLOURS, GLTF_COLOURS_AND_ALPHA };

/* Adds references to this material's objects to a shape; they are made at the first use. */
void gltf_add_material(struct gltf *g, struct xml_element *shape, const struct gltf_entry *material,
		       enum gltf_vertex_colours colours);
bool gltf_material_emits(struct gltf *g, const struct gltf_entry *material, double rgb[3]); /* rgb: radiance */
void gltf_add_default_material(struct gltf *g, struct xml_element *shape, enum gltf_vertex_colours colours);

#endif
