/* SPDX-License-Identifier: Apache-2.0 */
/* The shapes of a world while it is built: read in double, moved into the unit sphere, rounded to float. One thread. */
#ifndef WORKER_RENDER_WORLD_GEOMETRY_H
#define WORKER_RENDER_WORLD_GEOMETRY_H

#include "worker/render/world/build_private.h"

/* Reads the scene's shapes in double and computes their bounding box. A shape with nothing to hit is left out. */
int build_read_shapes(struct builder *b);
/* Chooses the world's centre and scale, and moves the camera accordingly. */
int build_rescale(struct builder *b);
/* Converts the shapes to floats in the rescaled world. */
int build_place_shapes(struct builder *b);

#endif
