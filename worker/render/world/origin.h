/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Where the world's floats are finest. They have 24 bits of a coordinate: what is small has to stand near the origin,
 * or rays and vertices are rounded by more than it is large. Pure; one thread.
 */
#ifndef WORKER_RENDER_WORLD_ORIGIN_H
#define WORKER_RENDER_WORLD_ORIGIN_H

#include "worker/render/math/vec3.h"

#include <stdint.h>

struct box {
	vec3 low, high;
};

struct weighed { /* a number, and how much it counts */
	double at, weight;
};

void box_grow(struct box *b, vec3 p);
double box_extent(const struct box *b); /* its largest side */

/* The centre of the box around all; of a scene of mixed scales, whose smallest shape is less than 2^-12 of it, the
 * median along each axis of the shapes' centres, weighted by 1 / extent: amid what is small. `room` is for `count`. */
vec3 origin_choose(const struct box *all, const struct box *shapes, uint32_t count, struct weighed *room);

/* Extent from which on triangles of such a scene are too large for floats, in its own lengths, as in
 * worker/render/geom/accel.c; INFINITY: the scene is not one of mixed scales. */
double origin_wide_from(const struct box *all, const struct box *shapes, uint32_t count);

#endif
