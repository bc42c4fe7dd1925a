/* SPDX-License-Identifier: Apache-2.0 */
/* Parallelograms of meshes. */
#ifndef WORKER_RENDER_SHAPE_QUAD_H
#define WORKER_RENDER_SHAPE_QUAD_H

#include "worker/render/shape/mesh.h"

/* Corners in a circle: (u, v) of each. */
extern const double quad_corner[4][2];

/* Two triangles, `triangle` and the one behind it, of the vertices first .. first+3 in a circle. */
void quad_set(struct mesh *m, uint32_t triangle, uint32_t first);

#endif
