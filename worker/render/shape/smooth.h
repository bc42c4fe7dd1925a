/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `max_smooth_angle` of Mitsuba 0.6: normals are dropped and computed again, across edges that are not too sharp.
 * Around each place (corners with the same position, texture coordinates and attributes) triangles are grouped in
 * order: the first remaining one, and all others whose normals are within the angle of its own, share a vertex.
 */
#ifndef WORKER_RENDER_SHAPE_SMOOTH_H
#define WORKER_RENDER_SHAPE_SMOOTH_H

#include "worker/render/shape/mesh.h"

/* Splits and joins vertices accordingly; the mesh has no normals afterwards, and no triangle without area. -E2BIG if
 * too many triangles of different directions meet in one place. */
int mesh_smooth(struct mesh *m, double degrees, struct arena *arena, const struct scene_node *n, struct error *e);

#endif
