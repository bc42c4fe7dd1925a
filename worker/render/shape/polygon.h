/* SPDX-License-Identifier: Apache-2.0 */
/* Polygons of mesh files as triangles. Any thread; allocates nothing; ticks (common/base/liveness.h). */
#ifndef WORKER_RENDER_SHAPE_POLYGON_H
#define WORKER_RENDER_SHAPE_POLYGON_H

#include "worker/render/math/vec3.h"

#include <stdint.h>

enum { POLYGON_MOST = 1024 };

struct polygon {
	uint32_t n;
	vec3 corner[POLYGON_MOST];
};

/* Of at least three corners: n - 2 triangles t of corners, each with the polygon's sense. It may be concave, slightly
 * bent, and have corners in common places; what crosses itself gives n - 2 triangles as well. A fan around the first
 * corner where that covers it. */
void polygon_cut(const struct polygon *p, uint32_t (*t)[3]);

#endif
