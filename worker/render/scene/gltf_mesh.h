/* SPDX-License-Identifier: Apache-2.0 */
/* Meshes. Private to gltf*.c. */
#ifndef WORKER_RENDER_SCENE_GLTF_MESH_H
#define WORKER_RENDER_SCENE_GLTF_MESH_H

#include "worker/render/scene/gltf_tree.h"

/* The shapes of a mesh under that matrix. */
void gltf_mesh(struct gltf *g, const struct gltf_at *mesh, const mat4 *to_world);

#endif
