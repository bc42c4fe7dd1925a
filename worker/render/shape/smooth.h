/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `max_smooth_angle` of Mitsuba 0.6: normals are dropped, to be recomputed across edges that are not too sharp. At each
 * place (corners with the same position, texture coordinates and attributes) triangles are grouped in order: the first
 * remaining triangle, and all others whose normals are within the angle of its own, share a vertex.
 */
#ifndef WORKER_RENDER_SHAPE_SMOOTH_H
#define WORKER_RENDER_SHAPE_SMOOTH_H

#include "worker/render/shape/mesh.h"

/* Splits and joins the vertices of m in this way and removes its normals. m must not have triangles without area.
 * Returns 0, -ENOMEM, or -E2BIG if too many triangles with different directions meet at one place. */
int mesh_smooth(struct mesh *m, double degrees, struct arena *arena, const struct scene_node *n, struct error *e);

#endif
