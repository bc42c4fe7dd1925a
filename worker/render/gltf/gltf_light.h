/* SPDX-License-Identifier: Apache-2.0 */
/* Lights and cameras. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_LIGHT_H
#define WORKER_RENDER_GLTF_GLTF_LIGHT_H

#include "worker/render/gltf/gltf_tree.h"

void gltf_add_light(struct gltf *g, const struct gltf_entry *light, const mat4 *to_world);
void gltf_add_camera(struct gltf *g, const struct gltf_entry *camera, const mat4 *to_world);
/* Supply what the file lacks: a camera that sees everything, an environment. */
void gltf_add_default_camera(struct gltf *g);
void gltf_add_default_light(struct gltf *g);

#endif
