/* SPDX-License-Identifier: Apache-2.0 */
/* Parallelograms of meshes. */
#ifndef WORKER_RENDER_SHAPE_QUAD_H
#define WORKER_RENDER_SHAPE_QUAD_H

#include "worker/render/shape/mesh.h"

/* Corners in order around it: (u, v) of each. */
extern const double quad_corner[4][2];

/* Two triangles, `triangle` and the next, with the vertices first .. first+3 in order around it. */
void quad_set(struct mesh *m, uint32_t triangle, uint32_t first);

#endif
