/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chooses the origin, where the world's floats are most precise. Floats have 24 bits per coordinate: small things must
 * be near the origin, or the rounding of rays and vertices exceeds their size. Pure; one thread.
 */
#ifndef WORKER_RENDER_WORLD_WORLD_ORIGIN_H
#define WORKER_RENDER_WORLD_WORLD_ORIGIN_H

#include "worker/render/world/box.h"

#include <stdint.h>

/* A number and its weight. */
struct weighted_value {
	double value, weight;
};
int weighted_value_compare(const void *a, const void *b); /* for qsort, by `value` */

/* Returns the origin: the centre of the bounding box; in a scene of mixed scales, whose smallest shape is less than
 * 2^-12 of the scene's extent, the median along each axis of the shapes' centres, weighted by 1 / extent, so that it
 * lies among small things. `scratch` needs space for `count` values. */
vec3 world_origin_choose(const struct box *scene_box, const struct box *shapes, uint32_t count,
			 struct weighted_value *scratch);

/* Returns the extent from which triangles of a scene of mixed scales are too large for floats, in the scene's lengths,
 * as in worker/render/geom/accel.c; INFINITY if the scene does not have mixed scales. */
double world_origin_min_wide_extent(const struct box *scene_box, const struct box *shapes, uint32_t count);

#endif
