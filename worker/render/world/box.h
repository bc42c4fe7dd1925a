/* SPDX-License-Identifier: Apache-2.0 */
/* Axis-aligned boxes. Pure. */
#ifndef WORKER_RENDER_WORLD_BOX_H
#define WORKER_RENDER_WORLD_BOX_H

#include "worker/render/math/vec3.h"

#include <stdbool.h>

struct box {
	vec3 min, max;
};

/* Returns the box of no points, with low above high. */
struct box box_empty(void);
void box_grow(struct box *b, vec3 p);
double box_extent(const struct box *b); /* length of the largest side */
/* Whether the ray from p along d meets the box at a distance of at most t_max. */
bool box_is_hit(const struct box *b, vec3 p, vec3 d, double t_max);

#endif
