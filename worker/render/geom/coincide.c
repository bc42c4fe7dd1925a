/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tests whether two primitives coincide, and decides which of several coinciding primitives is present.
 *
 * Two triangles can only coincide if their planes have the same direction, which rejects most pairs. Then one triangle
 * is clipped against the other as seen along the normal of the latter. They coincide if the corners of the resulting
 * polygon are no farther from the other's plane than the rounding of both triangles' vertices (floats: 2^-24 of each
 * coordinate), and if the polygon is wider than a few such roundings. The corners decide for the whole polygon because
 * both triangles are plane.
 */
#include "worker/render/geom/coincide.h"

#include "common/base/mem.h"

#include <float.h>

enum { CORNERS = 9 }; /* three corners and at most one more per cut, with room to spare */

struct polygon {
	vec3 p[CORNERS];
	unsigned n;
};

/* Keeps the part of the polygon with side.(p - at) >= 0. */
static void cut_polygon(struct polygon *a, vec3 at, vec3 side)
{
	struct polygon out = {.n = 0};
	for (unsigned i = 0; i < a->n; i++) {
		vec3 p = a->p[i], q = a->p[(i + 1) % a->n];
		double u = vec3_dot(side, vec3_sub(p, at)), v = vec3_dot(side, vec3_sub(q, at));
		if (u >= 0)
			out.p[out.n++] = p;
		if ((u > 0 && v < 0) || (u < 0 && v > 0))
			out.p[out.n++] = vec3_madd(p, u / (u - v), vec3_sub(q, p));
	}
	*a = out;
}

static double largest(double a, double b, double c)
{
	return fmax(fabs(a), fmax(fabs(b), fabs(c)));
}

/* Returns how far the rounding of its vertices can move a triangle along n. */
static double rounded_along(const struct triangle *t, vec3 n)
{
	return t->rounding * (fabs(n.x) * largest(t->v[0].x, t->v[1].x, t->v[2].x) +
			      fabs(n.y) * largest(t->v[0].y, t->v[1].y, t->v[2].y) +
			      fabs(n.z) * largest(t->v[0].z, t->v[1].z, t->v[2].z));
}

static double largest_coordinate(const struct triangle *t)
{
	double far = 0;
	for (int i = 0; i < 3; i++)
		far = fmax(far, largest(t->v[i].x, t->v[i].y, t->v[i].z));
	return far;
}

/* Whether the overlap is more than rounding. It must be wider than about eight roundings of its own coordinates to
 * float, and than the error of the cuts that made it, which is that of doubles, but relative to the triangles' corners,
 * whose coordinates are at most `cuts`. The latter matters for triangles that share a corner at the origin, where the
 * roundings of the overlap's own coordinates are almost 0. */
static bool has_width(const struct polygon *a, vec3 n, double cuts)
{
	double area2 = 0, around = 0, far = 0x1p-27 * cuts;
	for (unsigned i = 0; i < a->n; i++) {
		vec3 from = vec3_sub(a->p[i], a->p[0]), to = vec3_sub(a->p[(i + 1) % a->n], a->p[0]);
		area2 += vec3_dot(n, vec3_cross(from, to));
		around += vec3_length(vec3_sub(to, from));
		far = fmax(far, largest(a->p[i].x, a->p[i].y, a->p[i].z));
	}
	return fabs(area2) > 0x1p-21 * far * around;
}

struct coincide_facing coincide_facing_of(const struct triangle *t)
{
	double length = vec3_length(t->n);
	if (!(length >= DBL_MIN))
		return (struct coincide_facing){.altitude = 0};
	/* An upper bound of rounded_along for any direction, with room for the rounding of n. */
	return (struct coincide_facing){vec3_scale(1 / length, t->n), triangle_altitude(t),
					2 * t->rounding * largest_coordinate(t)};
}

/* Whether rounding can account for the angle between the planes. */
static bool have_one_direction(const struct triangle *a, const struct triangle *b, double rounded)
{
	double across = vec3_length(vec3_cross(a->n, b->n)), lengths = vec3_length(a->n) * vec3_length(b->n);
	return across * fmin(triangle_altitude(a), triangle_altitude(b)) <= COINCIDE_TILT * rounded * lengths;
}

bool coincide_triangles(const struct triangle *a, const struct triangle *b, double off, bool *wholly)
{
	vec3 n = vec3_normalize(b->n);
	double rounded = rounded_along(a, n) + rounded_along(b, n) + off;
	if (!have_one_direction(a, b, rounded))
		return false;
	struct polygon over = {{a->v[0], a->v[1], a->v[2]}, 3};
	for (int i = 0; i < 3 && over.n > 0; i++) {
		vec3 from = b->v[i], to = b->v[(i + 1) % 3];
		cut_polygon(&over, from, vec3_cross(n, vec3_sub(to, from)));
	}
	/* Twice the rounding error, to allow for earlier roundings in double and for the sums here. */
	double within = 2 * rounded;
	for (unsigned i = 0; i < over.n; i++)
		if (!(fabs(vec3_dot(n, vec3_sub(over.p[i], b->v[0]))) <= within))
			return false;
	*wholly = over.n == 3 && vec3_length(vec3_sub(over.p[0], a->v[0])) == 0 &&
		  vec3_length(vec3_sub(over.p[1], a->v[1])) == 0 && vec3_length(vec3_sub(over.p[2], a->v[2])) == 0;
	return over.n >= 3 && has_width(&over, n, fmax(largest_coordinate(a), largest_coordinate(b)));
}

static double farthest_coordinate(const struct accel_shape *s)
{
	return triangle_norm_max(s->center) + s->radius;
}

bool coincide_spheres(const struct accel_shape *a, const struct accel_shape *b)
{
	vec3 between = vec3_sub(a->center, b->center);
	double within = 0x1p-23 * fmax(farthest_coordinate(a), farthest_coordinate(b));
	return triangle_norm1(between) + fabs(a->radius - b->radius) <= within;
}

/* Whether a triangle covers the point p, as seen along n. */
static bool is_covered_by(const struct accel_shape *s, uint32_t prim, vec3 p, vec3 n)
{
	const struct triangle t = accel_triangle(s, prim, 0);
	double unused;
	return triangle_meets(&t, p, n, &unused);
}

static const struct coincide_pair *find_first(const struct coincidence *c, struct prim_ref prim,
					      const struct coincide_pair *end)
{
	const struct coincide_pair *low = c->pairs + c->first[prim.shape];
	while (low < end) {
		const struct coincide_pair *middle = low + (end - low) / 2;
		if (middle->hidden.prim < prim.prim)
			low = middle + 1;
		else
			end = middle;
	}
	return low;
}

/* Finds a primitive that hides `prim` at p. Returns false if there is none. */
static bool find_hiding(const struct coincidence *c, const struct accel_shape *shapes, struct prim_ref prim, vec3 p,
			struct prim_ref *by)
{
	const struct coincide_pair *end = c->pairs + c->first[prim.shape + 1], *at = find_first(c, prim, end);
	if (at == end || at->hidden.prim != prim.prim)
		return false;
	const struct accel_shape *s = &shapes[prim.shape];
	vec3 n = s->is_sphere ? (vec3){0, 0, 0} : accel_triangle(s, prim.prim, 0).n;
	for (; at < end && at->hidden.prim == prim.prim; at++)
		if (at->wholly || is_covered_by(&shapes[at->by.shape], at->by.prim, p, n)) {
			*by = (struct prim_ref){at->by.shape, at->by.prim, prim.time};
			return true;
		}
	return false;
}

struct prim_ref coincide_there(const struct coincidence *c, const struct accel_shape *shapes, struct prim_ref prim,
			       vec3 p)
{
	/* The primitive that hides it may be hidden itself. The loop ends because each step leads to an earlier
	 * one in the order of ranks. */
	while (c && prim.shape != PRIM_NONE.shape && c->first[prim.shape] < c->first[prim.shape + 1] &&
	       find_hiding(c, shapes, prim, p, &prim))
		;
	return prim;
}

void coincide_free(struct coincidence *c)
{
	if (!c)
		return;
	mem_free(c->pairs);
	mem_free(c->shapes);
	mem_free(c->first);
	mem_free(c);
}
