/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Most polygons are convex and are meant as fans around their first corner. A fan is kept if all of its triangles have
 * the orientation of the polygon. Other polygons are cut by removing one ear after the other (Meisters 1975, "Polygons
 * have ears"): an ear is a corner with an angle below 180 degrees, whose triangle with its neighbours contains no other
 * corner. Ears are searched for in the projection along the axis nearest to the polygon's normal (Newell's: the sum of
 * the cross products around it).
 *
 * An outline that crosses itself may have no ear, and the search for ears may take time cubic in the number of corners.
 * After CHECKS_PER_CORNER comparisons per corner, or if no corner is an ear, corners are therefore cut off in order.
 * The time is thus linear in the size of a file, whatever it contains.
 */
#include "worker/render/shape/polygon.h"

#include "common/base/liveness.h"

#include <stdbool.h>
#include <string.h>

enum { CHECKS_PER_CORNER = 4096 };

/* Because corners are rounded, a triangle of the fan may have the opposite orientation by this share of the polygon's
 * area. */
#define REVERSED_AREA_MAX 1e-5

/* Returns twice the area of a triangle of the fan, as a vector. */
static vec3 doubled_fan_area(const struct polygon *p, uint32_t i)
{
	return vec3_cross(vec3_sub(p->corner[i - 1], p->corner[0]), vec3_sub(p->corner[i], p->corner[0]));
}

static vec3 polygon_normal(const struct polygon *p)
{
	vec3 sum = {0, 0, 0};
	for (uint32_t i = 2; i < p->corner_count; i++)
		sum = vec3_add(sum, doubled_fan_area(p, i));
	return sum;
}

static bool fan_covers(const struct polygon *p, vec3 normal)
{
	double min_dot = -REVERSED_AREA_MAX * vec3_dot(normal, normal);
	for (uint32_t i = 2; i < p->corner_count; i++)
		if (vec3_dot(doubled_fan_area(p, i), normal) < min_dot)
			return false;
	return true;
}

struct point2 {
	double x, y;
};

struct outline {
	struct point2 p[POLYGON_CORNERS_MAX]; /* counter-clockwise */
	uint32_t previous[POLYGON_CORNERS_MAX], next[POLYGON_CORNERS_MAX];
	uint64_t remaining_checks; /* remaining comparisons */
};

static void project_outline(struct outline *o, const struct polygon *p, vec3 normal)
{
	double x = fabs(normal.x), y = fabs(normal.y), z = fabs(normal.z);
	for (uint32_t i = 0; i < p->corner_count; i++) {
		vec3 c = vec3_sub(p->corner[i], p->corner[0]);
		if (z >= x && z >= y)
			o->p[i] = normal.z > 0 ? (struct point2){c.x, c.y} : (struct point2){c.y, c.x};
		else if (y >= x)
			o->p[i] = normal.y > 0 ? (struct point2){c.z, c.x} : (struct point2){c.x, c.z};
		else
			o->p[i] = normal.x > 0 ? (struct point2){c.y, c.z} : (struct point2){c.z, c.y};
		o->previous[i] = i ? i - 1 : p->corner_count - 1;
		o->next[i] = i + 1 < p->corner_count ? i + 1 : 0;
	}
}

/* Returns twice the area of a triangle, positive if it is counter-clockwise. */
static double doubled_area(struct point2 a, struct point2 b, struct point2 c)
{
	return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static bool same_point(struct point2 a, struct point2 b)
{
	return a.x == b.x && a.y == b.y;
}

static bool is_ear(struct outline *o, uint32_t i)
{
	struct point2 a = o->p[o->previous[i]], b = o->p[i], c = o->p[o->next[i]];
	if (!(doubled_area(a, b, c) > 0))
		return false;
	for (uint32_t k = o->next[o->next[i]]; k != o->previous[i]; k = o->next[k]) {
		struct point2 q = o->p[k];
		o->remaining_checks -= o->remaining_checks > 0;
		if (doubled_area(a, b, q) >= 0 && doubled_area(b, c, q) >= 0 && doubled_area(c, a, q) >= 0 &&
		    !same_point(q, a) && !same_point(q, b) && !same_point(q, c))
			return false;
	}
	return true;
}

static void clip_ears(const struct polygon *p, vec3 normal, uint32_t (*t)[3])
{
	struct outline o;
	uint32_t corner = 0, tried = 0;
	project_outline(&o, p, normal);
	o.remaining_checks = (uint64_t)CHECKS_PER_CORNER * p->corner_count;
	for (uint32_t remaining = p->corner_count; remaining > 2;) {
		uint32_t previous = o.previous[corner], next = o.next[corner];
		if (remaining > 3 && tried < remaining && o.remaining_checks > 0 && !is_ear(&o, corner)) {
			corner = next;
			tried++;
			continue;
		}
		memcpy(t++, (uint32_t[3]){previous, corner, next}, sizeof *t);
		o.next[previous] = next;
		o.previous[next] = previous;
		corner = next;
		remaining--;
		tried = 0;
	}
}

void polygon_triangulate(const struct polygon *p, uint32_t (*t)[3])
{
	vec3 normal = polygon_normal(p);
	if (!fan_covers(p, normal)) {
		liveness_tick();
		clip_ears(p, normal, t);
		return;
	}
	for (uint32_t i = 0; i + 2 < p->corner_count; i++)
		memcpy(t + i, (uint32_t[3]){0, i + 1, i + 2}, sizeof *t);
}
