/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Most polygons are convex and are meant as fans around their first corner. A fan is kept if all of its triangles have
 * the orientation of the polygon. Other polygons are cut by removing one ear after the other (Meisters 1975, "Polygons
 * have ears"): an ear is a corner with an angle below 180 degrees, whose triangle with its neighbours contains no other
 * corner. Ears are searched for in the projection along the axis nearest to the polygon's normal (Newell's: the sum of
 * the cross products around it).
 *
 * An outline that crosses itself may have no ear, and the search for ears may take time cubic in the number of corners.
 * After CHECKS comparisons per corner, or if no corner is an ear, corners are therefore cut off in order. The time is
 * thus linear in the size of a file, whatever it contains.
 */
#include "worker/render/shape/polygon.h"

#include "common/base/liveness.h"

#include <stdbool.h>
#include <string.h>

enum { CHECKS = 4096 };

/* Because corners are rounded, a triangle of the fan may have the opposite orientation by this share of the polygon's
 * area. */
#define TURNED_MOST 1e-5

/* Returns twice the area of a triangle of the fan, as a vector. */
static vec3 fan_area(const struct polygon *p, uint32_t i)
{
	return vec3_cross(vec3_sub(p->corner[i - 1], p->corner[0]), vec3_sub(p->corner[i], p->corner[0]));
}

static vec3 normal_of(const struct polygon *p)
{
	vec3 sum = {0, 0, 0};
	for (uint32_t i = 2; i < p->n; i++)
		sum = vec3_add(sum, fan_area(p, i));
	return sum;
}

static bool fan_covers(const struct polygon *p, vec3 normal)
{
	double least = -TURNED_MOST * vec3_dot(normal, normal);
	for (uint32_t i = 2; i < p->n; i++)
		if (vec3_dot(fan_area(p, i), normal) < least)
			return false;
	return true;
}

struct flat {
	double x, y;
};

struct outline {
	struct flat p[POLYGON_MOST]; /* counter-clockwise */
	uint32_t before[POLYGON_MOST], after[POLYGON_MOST];
	uint64_t checks; /* remaining comparisons */
};

static void flatten(struct outline *o, const struct polygon *p, vec3 normal)
{
	double x = fabs(normal.x), y = fabs(normal.y), z = fabs(normal.z);
	for (uint32_t i = 0; i < p->n; i++) {
		vec3 c = vec3_sub(p->corner[i], p->corner[0]);
		if (z >= x && z >= y)
			o->p[i] = normal.z > 0 ? (struct flat){c.x, c.y} : (struct flat){c.y, c.x};
		else if (y >= x)
			o->p[i] = normal.y > 0 ? (struct flat){c.z, c.x} : (struct flat){c.x, c.z};
		else
			o->p[i] = normal.x > 0 ? (struct flat){c.y, c.z} : (struct flat){c.z, c.y};
		o->before[i] = i ? i - 1 : p->n - 1;
		o->after[i] = i + 1 < p->n ? i + 1 : 0;
	}
}

/* Returns twice the area of a triangle, positive if it is counter-clockwise. */
static double area(struct flat a, struct flat b, struct flat c)
{
	return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static bool same_point(struct flat a, struct flat b)
{
	return a.x == b.x && a.y == b.y;
}

static bool is_ear(struct outline *o, uint32_t i)
{
	struct flat a = o->p[o->before[i]], b = o->p[i], c = o->p[o->after[i]];
	if (!(area(a, b, c) > 0))
		return false;
	for (uint32_t k = o->after[o->after[i]]; k != o->before[i]; k = o->after[k]) {
		struct flat q = o->p[k];
		o->checks -= o->checks > 0;
		if (area(a, b, q) >= 0 && area(b, c, q) >= 0 && area(c, a, q) >= 0 && !same_point(q, a) &&
		    !same_point(q, b) && !same_point(q, c))
			return false;
	}
	return true;
}

static void cut_ears(const struct polygon *p, vec3 normal, uint32_t (*t)[3])
{
	struct outline o;
	uint32_t at = 0, tried = 0;
	flatten(&o, p, normal);
	o.checks = (uint64_t)CHECKS * p->n;
	for (uint32_t left = p->n; left > 2;) {
		uint32_t before = o.before[at], after = o.after[at];
		if (left > 3 && tried < left && o.checks > 0 && !is_ear(&o, at)) {
			at = after;
			tried++;
			continue;
		}
		memcpy(t++, (uint32_t[3]){before, at, after}, sizeof *t);
		o.after[before] = after;
		o.before[after] = before;
		at = after;
		left--;
		tried = 0;
	}
}

void polygon_cut(const struct polygon *p, uint32_t (*t)[3])
{
	vec3 normal = normal_of(p);
	if (!fan_covers(p, normal)) {
		liveness_tick();
		cut_ears(p, normal, t);
		return;
	}
	for (uint32_t i = 0; i + 2 < p->n; i++)
		memcpy(t + i, (uint32_t[3]){0, i + 1, i + 2}, sizeof *t);
}
