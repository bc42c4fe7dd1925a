/* SPDX-License-Identifier: Apache-2.0 */
/* A shape's box, and its mesh as floats, or doubles where it is too large for those, for worlds that are built. One
 * thread. */
#ifndef WORKER_RENDER_WORLD_PLACE_MESH_H
#define WORKER_RENDER_WORLD_PLACE_MESH_H

#include "worker/render/world/build_private.h"

struct box build_box_of(const struct shape_geometry *g);
bool build_is_displaced(const struct builder *b, const struct scene_node *shape);
/* A mesh as floats in the frame of that centre and scale. */
int build_place_mesh(struct builder *b, struct geom_shape *g, struct mesh *m, const struct scene_node *n, vec3 center,
		     double scale);

/* Keeps the vertices in double of a shape that build_place_mesh has made, if the extent of one of its triangles is
 * `least` or more, in the rescaled world: of a large triangle that neither lies along the axes nor has its middle at
 * the origin, what is rounded of its vertices moves all of it, by more than what is small beside it is large. */
int build_keep_unrounded(struct builder *b, struct geom_shape *g, const struct mesh *m, double least);

#endif
