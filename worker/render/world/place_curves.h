/* SPDX-License-Identifier: Apache-2.0 */
/* For building worlds: curves as chains of round cones, in floats. One thread. */
#ifndef WORKER_RENDER_WORLD_PLACE_CURVES_H
#define WORKER_RENDER_WORLD_PLACE_CURVES_H

#include "worker/render/world/build_private.h"

int build_place_curves(struct builder *b, struct geom_shape *g, const struct curve *c, const struct scene_node *n);

#endif
