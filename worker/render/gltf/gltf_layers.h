/* SPDX-License-Identifier: Apache-2.0 */
/* Extensions of materials. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_LAYERS_H
#define WORKER_RENDER_GLTF_GLTF_LAYERS_H

#include "worker/render/gltf/gltf_tree.h"

/* All of a material, as properties of a `principled`, and its roughness, times the green of the texture (NULL: none),
 * which one of them changes. */
void gltf_put_layers(struct gltf *g, struct xml_element *el, const struct gltf_at *material, double roughness,
		     const json_t *texture);
/* A note of each unknown extension that the file does not list: gltf.c tells of those that it does. */
void gltf_note_foreign(struct gltf *g, const struct gltf_at *material);

#endif
