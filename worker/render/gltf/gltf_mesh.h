/* SPDX-License-Identifier: Apache-2.0 */
/* Meshes. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_MESH_H
#define WORKER_RENDER_GLTF_GLTF_MESH_H

#include "worker/render/gltf/gltf_tree.h"

/* The shapes of that mesh of a node, under that matrix. */
void gltf_mesh(struct gltf *g, const struct gltf_at *mesh, const struct gltf_at *node, const mat4 *to_world);
/* As often as the extension EXT_mesh_gpu_instancing says. */
void gltf_mesh_instances(struct gltf *g, const struct gltf_at *mesh, const struct gltf_at *node,
			 const json_t *extension, const mat4 *to_world);

#endif
