/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chooses the origin, where the world's floats are most precise. They have 24 bits per coordinate: small things must be
 * near the origin, or the rounding of rays and vertices exceeds their size. Pure; one thread.
 */
#ifndef WORKER_RENDER_WORLD_ORIGIN_H
#define WORKER_RENDER_WORLD_ORIGIN_H

#include "worker/render/world/box.h"

#include <stdint.h>

struct weighted_value { /* a number, and its weight */
	double at, weight;
};
int weighted_value_compare(const void *a, const void *b); /* for qsort, by the number */

/* The centre of the bounding box; in a scene of mixed scales, whose smallest shape is less than 2^-12 of it, the
 * median along each axis of the shapes' centres, weighted by 1 / extent: among small things. `room` is for `count`. */
vec3 origin_choose(const struct box *all, const struct box *shapes, uint32_t count, struct weighted_value *room);

/* The extent from which triangles of such a scene are too large for floats, in the scene's lengths, as in
 * worker/render/geom/accel.c; INFINITY: the scene does not have mixed scales. */
double origin_wide_from(const struct box *all, const struct box *shapes, uint32_t count);

#endif
