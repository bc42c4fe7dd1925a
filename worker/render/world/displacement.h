/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Displacement in a scene: a texture named `displacement` in a shape, with displacement_scale (world units, 1) and
 * displacement_level. Heights are plain numbers: the pixels of a bitmap as stored, not as sRGB. One thread.
 */
#ifndef WORKER_RENDER_WORLD_DISPLACEMENT_H
#define WORKER_RENDER_WORLD_DISPLACEMENT_H

#include "worker/render/shape/shape.h"

/* The property; NULL: the shape is not displaced. */
const struct property *displacement_of(const struct scene_node *shape);

/* Makes the finer mesh of a displaced shape in the arena; leaves others unchanged. tessellation: factor of the
 * pieces of an edge. */
int displacement_apply(struct shape_geometry *g, const struct scene_node *shape, const struct asset_source *assets,
		       bool dialect_3, double tessellation, struct arena *arena, struct error *e);

#endif
