/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/box.h"

#include <math.h>

struct box box_empty(void)
{
	return (struct box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

void box_grow(struct box *b, vec3 p)
{
	b->low = (vec3){fmin(b->low.x, p.x), fmin(b->low.y, p.y), fmin(b->low.z, p.z)};
	b->high = (vec3){fmax(b->high.x, p.x), fmax(b->high.y, p.y), fmax(b->high.z, p.z)};
}

double box_extent(const struct box *b)
{
	return fmax(b->high.x - b->low.x, fmax(b->high.y - b->low.y, b->high.z - b->low.z));
}
