/* SPDX-License-Identifier: Apache-2.0 */
/* For building worlds: a shape's bounding box, and its mesh as floats, or doubles if it is too large for those. One
 * thread. */
#ifndef WORKER_RENDER_WORLD_PLACE_MESH_H
#define WORKER_RENDER_WORLD_PLACE_MESH_H

#include "worker/render/world/build_private.h"

struct box build_box_of(const struct shape_geometry *g);
bool build_is_displaced(const struct builder *b, const struct scene_node *shape);
/* A mesh as floats, relative to that centre and scale. It may have no triangle left whose area is not 0 then. */
int build_place_mesh(struct builder *b, struct geom_shape *g, struct mesh *m, const struct scene_node *n, vec3 center,
		     double scale);

/* Keeps vertices in double for a shape made by build_place_mesh, if the extent of one of its triangles is at least
 * `least` in the rescaled world. If a large triangle is neither aligned with the axes nor centred at the origin, the
 * rounding of its vertices moves all of it, by more than the size of small things near it. */
int build_keep_unrounded(struct builder *b, struct geom_shape *g, const struct mesh *m, double least);

#endif
