/* SPDX-License-Identifier: Apache-2.0 */
/* While a world is built: a shape's bounding box, and its mesh as floats, or as doubles if it is too
 * large for floats. One thread. */
#ifndef WORKER_RENDER_WORLD_PLACE_MESH_H
#define WORKER_RENDER_WORLD_PLACE_MESH_H

#include "worker/render/world/build_private.h"

struct box build_bounding_box(const struct shape_geometry *g);
bool build_is_displaced(const struct builder *b, const struct scene_node *shape);
/* Converts a mesh to floats, relative to the given centre and scale. It may have no triangle with
 * an area left afterwards. */
int build_place_mesh(struct builder *b, struct geom_shape *g, struct mesh *m, const struct scene_node *n, vec3 center,
		     double scale);

/* Keeps vertices in double for a shape made by build_place_mesh if one of its triangles has an extent of at least
 * `min_extent` in the rescaled world. The rounding of the vertices of a large triangle moves the whole triangle, unless
 * it is aligned with the axes or centred at the origin, by more than the size of small things near it. */
int build_keep_unrounded(struct builder *b, struct geom_shape *g, const struct mesh *m, double min_extent);

#endif
