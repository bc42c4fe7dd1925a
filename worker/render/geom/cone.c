/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Intersections of lines with round cones.
 *
 * With y along the axis and x away from it, the side is where cos x + sin y = r0, and the double cone is where
 *
 *       F = cos^2 x^2 - (r0 - y sin)^2 = 0,
 *
 * a quadratic A t^2 + 2 B t + C along a line. It is solved around the point of the line that is nearest to the
 * cone, so that for a ray from far away nothing cancels except digits that its origin does not have, and then
 * around the middle of both roots, where the discriminant is the product of two small heights (as Haines et al.
 * 2019, Ray Tracing Gems ch. 7, do for spheres). The side ends at the circles in which it touches the spheres, at y
 * = r0 sin and length + r1 sin.
 *
 * Nothing fails: points and radii of any finite size give numbers, and where there is no side, cos is 0.
 */
#include "worker/render/geom/cone.h"

struct cone cone_between(vec3 p0, double r0, vec3 p1, double r1)
{
	vec3 span = vec3_sub(p1, p0);
	double length = vec3_length(span), radius_difference = r0 - r1;
	struct cone c = {.p0 = p0, .axis = {0, 0, 1}, .r0 = r0, .r1 = r1, .length = length};
	if (length > 0)
		c.axis = vec3_scale(1 / length, span);
	if (!(fabs(radius_difference) < length)) {
		c.sin = radius_difference >= 0 ? 1 : -1;
		return c;
	}
	c.sin = radius_difference / length;
	c.cos = sqrt((1 - c.sin) * (1 + c.sin));
	return c;
}

/* ---- lines ---- */

struct quadratic {
	double a, b, c; /* a t^2 + 2 b t + c */
};

/* The quadratic of the double cone along a line; q: origin of the line relative to p0. */
static struct quadratic side_quadratic(const struct cone *c, vec3 q, vec3 d)
{
	double y = vec3_dot(q, c->axis), dy = vec3_dot(d, c->axis), cos2 = c->cos * c->cos;
	vec3 x = vec3_madd(q, -y, c->axis), dx = vec3_madd(d, -dy, c->axis);
	double g = c->r0 - y * c->sin, width = c->cos * vec3_length(x);
	return (struct quadratic){cos2 * vec3_dot(dx, dx) - c->sin * c->sin * dy * dy,
				  cos2 * vec3_dot(x, dx) + c->sin * dy * g, (width - g) * (width + g)};
}

static bool solve_quadratic(const struct quadratic *f, double root[2])
{
	double discriminant = f->b * f->b - f->a * f->c;
	if (!(discriminant > 0))
		return false;
	double k = -f->b - copysign(sqrt(discriminant), f->b), first = f->c / k, second = f->a != 0 ? k / f->a : first;
	root[0] = fmin(first, second);
	root[1] = fmax(first, second);
	return true;
}

static bool side_roots(const struct cone *c, vec3 o, vec3 d, double root[2])
{
	vec3 from = vec3_sub(o, c->p0), to_middle = vec3_madd(from, -0.5 * c->length, c->axis);
	double d2 = vec3_dot(d, d), shift = -vec3_dot(to_middle, d) / d2, size = c->length + c->r0 + c->r1;
	vec3 q = vec3_madd(from, shift, d);
	struct quadratic f = side_quadratic(c, q, d);
	/* Not for a line nearly parallel to the surface: the middle of its two roots may be anywhere. */
	if (f.a > 0 && fabs(f.b) * sqrt(d2) <= 4 * size * f.a) {
		double correction = -f.b / f.a;
		shift += correction;
		f = side_quadratic(c, vec3_madd(q, correction, d), d);
	}
	if (!(c->cos > 0) || !solve_quadratic(&f, root))
		return false;
	root[0] += shift;
	root[1] += shift;
	return true;
}

static vec3 part_center(const struct cone *c, enum cone_part part)
{
	return part == CONE_END ? vec3_madd(c->p0, c->length, c->axis) : c->p0;
}

static double part_radius(const struct cone *c, enum cone_part part)
{
	return part == CONE_END ? c->r1 : c->r0;
}

static bool sphere_roots(vec3 center, double radius, vec3 o, vec3 d, double root[2])
{
	vec3 q = vec3_sub(o, center);
	double d2 = vec3_dot(d, d), middle = -vec3_dot(q, d) / d2;
	double line_distance = vec3_length(vec3_madd(q, middle, d)),
	       h2 = (radius - line_distance) * (radius + line_distance) / d2;
	if (!(h2 > 0))
		return false;
	root[0] = middle - sqrt(h2);
	root[1] = middle + sqrt(h2);
	return true;
}

bool cone_roots(const struct cone *c, enum cone_part part, vec3 o, vec3 d, double root[2])
{
	return part == CONE_SIDE ? side_roots(c, o, d, root)
				 : sphere_roots(part_center(c, part), part_radius(c, part), o, d, root);
}

double cone_other_root(const struct cone *c, enum cone_part part, vec3 o, vec3 d)
{
	if (part != CONE_SIDE)
		return -2 * vec3_dot(vec3_sub(o, part_center(c, part)), d) / vec3_dot(d, d);
	struct quadratic f = side_quadratic(c, vec3_sub(o, c->p0), d);
	return f.a != 0 ? -2 * f.b / f.a : INFINITY;
}

/* ---- points ---- */

double cone_height(const struct cone *c, enum cone_part part, vec3 p)
{
	if (part != CONE_SIDE)
		return vec3_length(vec3_sub(p, part_center(c, part))) - part_radius(c, part);
	vec3 q = vec3_sub(p, c->p0);
	double y = vec3_dot(q, c->axis);
	return c->cos * vec3_length(vec3_madd(q, -y, c->axis)) + y * c->sin - c->r0;
}

bool cone_part_contains(const struct cone *c, enum cone_part part, vec3 p, double slack)
{
	double y = vec3_dot(vec3_sub(p, c->p0), c->axis), first = c->r0 * c->sin, last = c->length + c->r1 * c->sin;
	switch (part) {
	case CONE_START:
		return c->sin > -1 && y <= first + slack;
	case CONE_END:
		return c->sin < 1 && y >= last - slack;
	default: /* excludes the other half of the double cone */
		return c->cos > 0 && y >= first - slack && y <= last + slack && y * c->sin <= c->r0;
	}
}

double cone_distance(const struct cone *c, vec3 p, bool open_start, bool open_end)
{
	vec3 q = vec3_sub(p, c->p0);
	double y = vec3_dot(q, c->axis), x = vec3_length(vec3_madd(q, -y, c->axis));
	double slope = c->cos * y - c->sin * x; /* cos times the y at which the normal through p meets the axis */
	if (c->cos > 0 ? slope <= 0 : c->sin > 0)
		return open_start ? INFINITY : vec3_length(q) - c->r0;
	if (c->cos > 0 ? slope >= c->cos * c->length : true)
		return open_end ? INFINITY : hypot(x, y - c->length) - c->r1;
	return c->cos * x + c->sin * y - c->r0;
}
