/* SPDX-License-Identifier: Apache-2.0 */
/* Cuts the polygons of mesh files into triangles. Any thread; allocates nothing; calls liveness_tick()
 * (common/base/liveness.h). */
#ifndef WORKER_RENDER_SHAPE_POLYGON_H
#define WORKER_RENDER_SHAPE_POLYGON_H

#include "worker/render/math/vec3.h"

#include <stdint.h>

enum { POLYGON_CORNERS_MAX = 1024 };

struct polygon {
	uint32_t corner_count;
	vec3 corner[POLYGON_CORNERS_MAX];
};

/* Cuts a polygon of n >= 3 corners into n - 2 triangles t of corner numbers, with the orientation of the polygon: a fan
 * around the first corner if that covers it. The polygon may be concave, slightly bent, and have coinciding corners;
 * one that crosses itself gives n - 2 triangles, too. */
void polygon_triangulate(const struct polygon *p, uint32_t (*t)[3]);

#endif
