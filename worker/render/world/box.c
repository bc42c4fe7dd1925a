/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/box.h"

struct box box_empty(void)
{
	return (struct box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

void box_grow(struct box *b, vec3 p)
{
	b->min = (vec3){fmin(b->min.x, p.x), fmin(b->min.y, p.y), fmin(b->min.z, p.z)};
	b->max = (vec3){fmax(b->max.x, p.x), fmax(b->max.y, p.y), fmax(b->max.z, p.z)};
}

double box_extent(const struct box *b)
{
	return fmax(b->max.x - b->min.x, fmax(b->max.y - b->min.y, b->max.z - b->min.z));
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
	return b->min.x <= b->max.x && clip_to_slab(b->min.x, b->max.x, p.x, d.x, t) &&
	       clip_to_slab(b->min.y, b->max.y, p.y, d.y, t) && clip_to_slab(b->min.z, b->max.z, p.z, d.z, t);
}
