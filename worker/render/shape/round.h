/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Round bodies as meshes: disks, cylinders and ellipsoids are prisms of ROUND_SEGMENTS sides with exact normals. Radii
 * are slightly enlarged so that a disk's area is exact; 256 sides keep the silhouette of a body of radius 1 within 8e-5
 * of the circle.
 */
#ifndef WORKER_RENDER_SHAPE_ROUND_H
#define WORKER_RENDER_SHAPE_ROUND_H

#include "worker/render/shape/mesh.h"

enum { ROUND_SEGMENTS = 256 };

/* Corner i of the polygon, i in 0 .. ROUND_SEGMENTS (the last equals the first): the unit direction, and the
 * polygon's radius for a circle of radius 1 with the same area. */
vec3 round_direction(uint32_t i);
double round_radius(void);

#endif
