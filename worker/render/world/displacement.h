/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Displacement in a scene: a texture named `displacement` in a shape, with displacement_scale (in world units;
 * default 1) and displacement_level. Heights are plain numbers: the stored pixel values of a bitmap, without
 * sRGB decoding. One thread.
 */
#ifndef WORKER_RENDER_WORLD_DISPLACEMENT_H
#define WORKER_RENDER_WORLD_DISPLACEMENT_H

#include "worker/render/shape/shape.h"

/* Returns the displacement property; NULL if the shape is not displaced. */
const struct property *displacement_property(const struct scene_node *shape);

/* Replaces the mesh of a displaced shape by a finer one in the arena; leaves other shapes unchanged. tessellation:
 * factor on the number of pieces into which an edge is divided. */
int displacement_apply(struct shape_geometry *g, const struct scene_node *shape, const struct asset_source *assets,
		       bool dialect_3, double tessellation, struct arena *arena, struct error *e);

#endif
