/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Displacement as a scene asks for it: a texture named `displacement` in a shape, with displacement_scale (world units,
 * 1) and displacement_level. Heights are plain numbers: of a bitmap the pixels as they are stored, not as sRGB. One
 * thread.
 */
#ifndef WORKER_RENDER_WORLD_DISPLACEMENT_H
#define WORKER_RENDER_WORLD_DISPLACEMENT_H

#include "worker/render/shape/shape.h"

/* The property; NULL: this shape is not displaced. */
const struct property *displacement_of(const struct scene_node *shape);

/* Makes the finer mesh of a displaced shape in the arena; leaves others alone. tessellation: factor of the parts of an
 * edge. */
int displacement_apply(struct shape_geometry *g, const struct scene_node *shape, const struct asset_source *assets,
		       bool dialect_3, double tessellation, struct arena *arena, struct error *e);

#endif
