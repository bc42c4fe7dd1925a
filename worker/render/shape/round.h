/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Round shapes as meshes: disks and cylinders are polygons and prisms of ROUND_SEGMENTS sides with exact normals. Radii
 * are slightly enlarged so that the area of a disk is exact; with 256 sides, the silhouette of a shape of radius 1 is
 * within 8e-5 of the circle.
 */
#ifndef WORKER_RENDER_SHAPE_ROUND_H
#define WORKER_RENDER_SHAPE_ROUND_H

#include "worker/render/shape/mesh.h"

enum { ROUND_SEGMENTS = 256 };

/* round_direction returns the unit direction of corner i of the polygon, i in 0 .. ROUND_SEGMENTS (the last equals the
 * first); round_radius returns the distance of its corners for which its area is that of a circle of radius 1. */
vec3 round_direction(uint32_t i);
double round_radius(void);

#endif
