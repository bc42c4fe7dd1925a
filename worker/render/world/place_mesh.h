/* SPDX-License-Identifier: Apache-2.0 */
/* A shape's box, and its mesh as floats, for worlds that are built. One thread. */
#ifndef WORKER_RENDER_WORLD_PLACE_MESH_H
#define WORKER_RENDER_WORLD_PLACE_MESH_H

#include "worker/render/world/build_private.h"

struct box build_box_of(const struct shape_geometry *g);
bool build_is_displaced(const struct builder *b, const struct scene_node *shape);
/* A mesh as floats in the frame of that centre and scale. */
int build_place_mesh(struct builder *b, struct geom_shape *g, struct mesh *m, const struct scene_node *n, vec3 center,
		     double scale);

#endif
