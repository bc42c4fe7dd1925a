/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `max_smooth_angle` of Mitsuba 0.6: normals are forgotten and computed again, across edges that are not too sharp.
 * Around each place (corners of one position, texture coordinates and attributes) triangles are taken together in
 * their order: the first that is left, with all others whose normals are within the angle of its own, share a vertex.
 */
#ifndef WORKER_RENDER_SHAPE_SMOOTH_H
#define WORKER_RENDER_SHAPE_SMOOTH_H

#include "worker/render/shape/mesh.h"

/* Splits and joins vertices so; the mesh has no normals afterwards, and none of its triangles is without an area.
 * -E2BIG where so many triangles of different directions meet in a place that looking at them has no end. */
int mesh_smooth(struct mesh *m, double degrees, struct arena *arena, const struct scene_node *n, struct error *e);

#endif
