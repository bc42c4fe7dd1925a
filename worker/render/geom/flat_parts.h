/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The triangles of a mesh by which its instances may coincide with something: those in planes that hold a hundredth of
 * its surface, such as the foot of a glass or the sides of a brick. That a triangle of a curved surface lies in the
 * plane of another is not looked for among instances, of which there may be millions. One thread.
 */
#ifndef WORKER_RENDER_GEOM_FLAT_PARTS_H
#define WORKER_RENDER_GEOM_FLAT_PARTS_H

#include "worker/render/geom/accel.h"

struct flat_parts {
	uint32_t count;
	uint32_t *prim; /* in rising order; freed by mem_free */
};

/* Of the mesh in its own frame. -ENOMEM. */
int flat_parts_find(struct flat_parts *f, const struct accel_shape *s);

#endif
