/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The triangles of a mesh whose instances may coincide with something: those in planes that contain at least a
 * hundredth of its area, such as the foot of a glass or the sides of a brick. Among instances, of which there may be
 * millions, coincidences of single triangles of curved surfaces are not searched for. One thread.
 */
#ifndef WORKER_RENDER_GEOM_FLAT_PARTS_H
#define WORKER_RENDER_GEOM_FLAT_PARTS_H

#include "worker/render/geom/accel.h"

struct flat_parts {
	uint32_t count;
	uint32_t *prims; /* in ascending order; freed with mem_free */
};

/* Finds the flat parts of the mesh in its own frame. Returns -ENOMEM if out of memory. */
int flat_parts_find(struct flat_parts *f, const struct accel_shape *s);

#endif
