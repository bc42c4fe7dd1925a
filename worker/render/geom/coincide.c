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
static void cut_polygon(struct polygon *a, vec3 point, vec3 side)
{
	struct polygon out = {.n = 0};
	for (unsigned i = 0; i < a->n; i++) {
		vec3 p = a->p[i], q = a->p[(i + 1) % a->n];
		double u = vec3_dot(side, vec3_sub(p, point)), v = vec3_dot(side, vec3_sub(q, point));
		if (u >= 0)
			out.p[out.n++] = p;
		if ((u > 0 && v < 0) || (u < 0 && v > 0))
			out.p[out.n++] = vec3_madd(p, u / (u - v), vec3_sub(q, p));
	}
	*a = out;
}

static double max_abs(double a, double b, double c)
{
	return fmax(fabs(a), fmax(fabs(b), fabs(c)));
}

/* Returns how far the rounding of its vertices can move a triangle along n. */
static double rounding_along(const struct triangle *t, vec3 n)
{
	return t->rounding * (fabs(n.x) * max_abs(t->v[0].x, t->v[1].x, t->v[2].x) +
			      fabs(n.y) * max_abs(t->v[0].y, t->v[1].y, t->v[2].y) +
			      fabs(n.z) * max_abs(t->v[0].z, t->v[1].z, t->v[2].z));
}

static double max_coordinate(const struct triangle *t)
{
	double max = 0;
	for (int i = 0; i < 3; i++)
		max = fmax(max, max_abs(t->v[i].x, t->v[i].y, t->v[i].z));
	return max;
}

/* Whether the overlap is more than rounding. It must be wider than about eight roundings of its own coordinates to
 * float, and than the error of the cuts that made it, which is that of doubles, but relative to the triangles' corners,
 * whose coordinates are at most `max_cut_coordinate`. The latter matters for triangles that share a corner at the
 * origin, where the roundings of the overlap's own coordinates are almost 0. */
static bool has_width(const struct polygon *a, vec3 n, double max_cut_coordinate)
{
	double area2 = 0, perimeter = 0, max = 0x1p-27 * max_cut_coordinate;
	for (unsigned i = 0; i < a->n; i++) {
		vec3 from = vec3_sub(a->p[i], a->p[0]), to = vec3_sub(a->p[(i + 1) % a->n], a->p[0]);
		area2 += vec3_dot(n, vec3_cross(from, to));
		perimeter += vec3_length(vec3_sub(to, from));
		max = fmax(max, max_abs(a->p[i].x, a->p[i].y, a->p[i].z));
	}
	return fabs(area2) > 0x1p-21 * max * perimeter;
}

struct coincide_facing coincide_facing_from_triangle(const struct triangle *t)
{
	double length = vec3_length(t->n);
	if (!(length >= DBL_MIN))
		return (struct coincide_facing){.altitude = 0};
	/* An upper bound of rounding_along for any direction, with room for the rounding of n. */
	return (struct coincide_facing){vec3_scale(1 / length, t->n), triangle_altitude(t),
					2 * t->rounding * max_coordinate(t)};
}

/* Whether rounding can account for the angle between the planes. */
static bool are_parallel(const struct triangle *a, const struct triangle *b, double rounding)
{
	double cross_length = vec3_length(vec3_cross(a->n, b->n)), lengths = vec3_length(a->n) * vec3_length(b->n);
	return cross_length * fmin(triangle_altitude(a), triangle_altitude(b)) <= COINCIDE_TILT * rounding * lengths;
}

bool coincide_triangles(const struct triangle *a, const struct triangle *b, double vertex_error, bool *covers_all)
{
	vec3 n = vec3_normalize(b->n);
	double rounding = rounding_along(a, n) + rounding_along(b, n) + vertex_error;
	if (!are_parallel(a, b, rounding))
		return false;
	struct polygon overlap = {{a->v[0], a->v[1], a->v[2]}, 3};
	for (int i = 0; i < 3 && overlap.n > 0; i++) {
		vec3 from = b->v[i], to = b->v[(i + 1) % 3];
		cut_polygon(&overlap, from, vec3_cross(n, vec3_sub(to, from)));
	}
	/* Twice the rounding error, to allow for earlier roundings in double and for the sums here. */
	double tolerance = 2 * rounding;
	for (unsigned i = 0; i < overlap.n; i++)
		if (!(fabs(vec3_dot(n, vec3_sub(overlap.p[i], b->v[0]))) <= tolerance))
			return false;
	*covers_all = overlap.n == 3 && vec3_length(vec3_sub(overlap.p[0], a->v[0])) == 0 &&
		      vec3_length(vec3_sub(overlap.p[1], a->v[1])) == 0 &&
		      vec3_length(vec3_sub(overlap.p[2], a->v[2])) == 0;
	return overlap.n >= 3 && has_width(&overlap, n, fmax(max_coordinate(a), max_coordinate(b)));
}

static double max_sphere_coordinate(const struct accel_shape *s)
{
	return triangle_norm_max(s->center) + s->radius;
}

bool coincide_spheres(const struct accel_shape *a, const struct accel_shape *b)
{
	vec3 between = vec3_sub(a->center, b->center);
	double tolerance = 0x1p-23 * fmax(max_sphere_coordinate(a), max_sphere_coordinate(b));
	return triangle_norm1(between) + fabs(a->radius - b->radius) <= tolerance;
}

/* Whether a triangle covers the point p, as seen along n. */
static bool triangle_covers(const struct accel_shape *s, uint32_t prim, vec3 p, vec3 n)
{
	const struct triangle t = accel_triangle(s, prim, 0);
	double unused;
	return triangle_intersect(&t, p, n, &unused);
}

static const struct coincide_pair *find_first_pair(const struct coincidence *c, struct prim_ref prim,
						   const struct coincide_pair *end)
{
	const struct coincide_pair *low = c->pairs + c->first_pair[prim.shape];
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
static bool find_covering(const struct coincidence *c, const struct accel_shape *shapes, struct prim_ref prim, vec3 p,
			  struct prim_ref *covering)
{
	const struct coincide_pair *end = c->pairs + c->first_pair[prim.shape + 1],
				   *pair = find_first_pair(c, prim, end);
	if (pair == end || pair->hidden.prim != prim.prim)
		return false;
	const struct accel_shape *s = &shapes[prim.shape];
	vec3 n = s->is_sphere ? (vec3){0, 0, 0} : accel_triangle(s, prim.prim, 0).n;
	for (; pair < end && pair->hidden.prim == prim.prim; pair++)
		if (pair->covers_all || triangle_covers(&shapes[pair->covering.shape], pair->covering.prim, p, n)) {
			*covering = (struct prim_ref){pair->covering.shape, pair->covering.prim, prim.time};
			return true;
		}
	return false;
}

struct prim_ref coincide_present_prim(const struct coincidence *c, const struct accel_shape *shapes,
				      struct prim_ref prim, vec3 p)
{
	/* The primitive that hides it may be hidden itself. The loop ends because each step leads to an earlier
	 * one in the order of ranks. */
	while (c && prim.shape != PRIM_NONE.shape && c->first_pair[prim.shape] < c->first_pair[prim.shape + 1] &&
	       find_covering(c, shapes, prim, p, &prim))
		;
	return prim;
}

void coincide_free(struct coincidence *c)
{
	if (!c)
		return;
	mem_free(c->pairs);
	mem_free(c->shape_pairs);
	mem_free(c->first_pair);
	mem_free(c);
}
