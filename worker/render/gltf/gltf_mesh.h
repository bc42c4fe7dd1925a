/* SPDX-License-Identifier: Apache-2.0 */
/* Meshes. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_MESH_H
#define WORKER_RENDER_GLTF_GLTF_MESH_H

#include "worker/render/gltf/gltf_tree.h"

/* Adds the shapes of a node's mesh, under that matrix. */
void gltf_add_mesh(struct gltf *g, const struct gltf_entry *mesh, const struct gltf_entry *node, const mat4 *to_world);
/* Like gltf_add_mesh(), once for each instance in the extension EXT_mesh_gpu_instancing. */
void gltf_add_mesh_instances(struct gltf *g, const struct gltf_entry *mesh, const struct gltf_entry *node,
			     const json_t *extension, const mat4 *to_world);

#endif
