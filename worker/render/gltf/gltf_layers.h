/* SPDX-License-Identifier: Apache-2.0 */
/* Extensions of materials. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_LAYERS_H
#define WORKER_RENDER_GLTF_GLTF_LAYERS_H

#include "worker/render/gltf/gltf_tree.h"

/* Adds all extensions of a material, as properties of a `principled`, and its roughness, which one of them changes.
 * The roughness is multiplied by the green channel of the texture (NULL: none). */
void gltf_put_layers(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, double roughness,
		     const json_t *texture);
/* Notes each unknown extension that the file does not list in extensionsUsed; those listed are noted by gltf.c. */
void gltf_note_unlisted_extensions(struct gltf *g, const struct gltf_entry *material);

#endif
