/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Round bodies as meshes: disks, cylinders and ellipsoids are prisms of ROUND_SEGMENTS sides with the body's own
 * normals. Radii are a little larger than asked for, so that a disk's area is right; 256 sides leave the silhouette of
 * a body of radius 1 within 8e-5 of the circle.
 */
#ifndef WORKER_RENDER_SHAPE_ROUND_H
#define WORKER_RENDER_SHAPE_ROUND_H

#include "worker/render/shape/mesh.h"

enum { ROUND_SEGMENTS = 256 };

/* Corner i of the polygon, i of 0 .. ROUND_SEGMENTS (the last is the first again): the direction, of length 1, and the
 * polygon's radius for a circle of radius 1 of the same area. */
vec3 round_direction(uint32_t i);
double round_radius(void);

#endif
