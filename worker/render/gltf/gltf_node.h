/* SPDX-License-Identifier: Apache-2.0 */
/* Matrices of nodes. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_NODE_H
#define WORKER_RENDER_GLTF_GLTF_NODE_H

#include "worker/render/gltf/gltf_tree.h"

enum { GLTF_NODE_DEPTH_MAX = 256 };

/* Returns the product of translation, rotation (a quaternion x y z w, of any length) and scale, in this order from
 * left to right: the scale applies first. *valid: the rotation is a quaternion. */
mat4 gltf_compose_transform(const double t[3], const double r[4], const double s[3], bool *valid);
mat4 gltf_matrix_from_columns(const double m[16]); /* from 16 numbers column by column, as in files */

mat4 gltf_node_matrix(struct gltf *g, const struct gltf_entry *node); /* from the node to its parent */
bool gltf_node_to_world(struct gltf *g, uint64_t index, mat4 *to_world);
/* Returns whether the node is no child of another; false after a failure. */
bool gltf_node_is_root(struct gltf *g, size_t index);

#endif
