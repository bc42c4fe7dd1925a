/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/box.h"

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

/* Narrows [t[0], t[1]] to the range between two planes perpendicular to an axis. Returns false if nothing is left. */
static bool clip_to_slab(double low, double high, double p, double d, double t[2])
{
	if (d == 0)
		return p >= low && p <= high;
	double a = (low - p) / d, b = (high - p) / d;
	t[0] = fmax(t[0], fmin(a, b));
	t[1] = fmin(t[1], fmax(a, b));
	return t[0] <= t[1];
}

bool box_is_hit(const struct box *b, vec3 p, vec3 d, double t_max)
{
	double t[2] = {0, t_max};
	return b->low.x <= b->high.x && clip_to_slab(b->low.x, b->high.x, p.x, d.x, t) &&
	       clip_to_slab(b->low.y, b->high.y, p.y, d.y, t) && clip_to_slab(b->low.z, b->high.z, p.z, d.z, t);
}
