/* SPDX-License-Identifier: Apache-2.0 */
/* Matrices of nodes. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_NODE_H
#define WORKER_RENDER_GLTF_GLTF_NODE_H

#include "worker/render/gltf/gltf_tree.h"

enum { GLTF_NODES_DEEP = 256 };

/* Translation, then rotation (a quaternion x y z w, of any length), then scale, from right to left. *valid false: the
 * rotation is no quaternion. */
mat4 gltf_compose(const double t[3], const double r[4], const double s[3], bool *valid);
mat4 gltf_columns(const double m[16]); /* from columns, as files have them */

mat4 gltf_node_matrix(struct gltf *g, const struct gltf_at *node); /* to its parent */
bool gltf_node_to_world(struct gltf *g, uint64_t index, mat4 *to_world);
/* No node has it as a child. After failures: false. */
bool gltf_node_is_root(struct gltf *g, size_t index);

#endif
