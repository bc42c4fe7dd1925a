/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/geom/coincide_spine.h"

#include "worker/render/geom/coincide.h"

#include <float.h>

/* Returns the direction of the largest variance of the mesh's vertices, by power iteration. Few steps suffice where it
 * matters, in long thin meshes; in other meshes any direction will do. */
static vec3 main_direction(const struct accel_shape *s, vec3 center, vec3 start)
{
	double c[6] = {0};
	vec3 d = start;
	for (uint32_t i = 0; i < s->vertex_count; i++) {
		vec3 v = vec3_sub(triangle_vertex(s->position, i), center);
		const double products[6] = {v.x * v.x, v.x * v.y, v.x * v.z, v.y * v.y, v.y * v.z, v.z * v.z};
		for (int k = 0; k < 6; k++)
			c[k] += products[k];
	}
	for (int step = 0; step < 4; step++) {
		vec3 next = {c[0] * d.x + c[1] * d.y + c[2] * d.z, c[1] * d.x + c[3] * d.y + c[4] * d.z,
			     c[2] * d.x + c[4] * d.y + c[5] * d.z};
		double length = vec3_length(next);
		if (!(length >= DBL_MIN))
			break;
		d = vec3_scale(1 / length, next);
	}
	return d;
}

static void add_to_box(struct spine *s, vec3 v)
{
	for (unsigned k = 0; k < 3; k++) {
		s->box_min[k] = fmin(s->box_min[k], vec3_component(v, k));
		s->box_max[k] = fmax(s->box_max[k], vec3_component(v, k));
	}
}

static vec3 box_middle(const struct spine *s)
{
	return (vec3){s->box_min[0] / 2 + s->box_max[0] / 2, s->box_min[1] / 2 + s->box_max[1] / 2,
		      s->box_min[2] / 2 + s->box_max[2] / 2};
}

/* Computes the segment along s->direction that covers all vertices, and its radius. */
static void fit_segment(struct spine *s, const struct accel_shape *mesh, vec3 center)
{
	double first = INFINITY, last = -INFINITY;
	for (uint32_t i = 0; i < mesh->vertex_count; i++) {
		vec3 v = vec3_sub(triangle_vertex(mesh->position, i), center);
		double t = vec3_dot(v, s->direction);
		first = fmin(first, t);
		last = fmax(last, t);
		s->radius = fmax(s->radius, vec3_length(vec3_sub(v, vec3_scale(t, s->direction))));
	}
	s->start = vec3_madd(center, first, s->direction);
	s->span = vec3_scale(last - first, s->direction);
}

static double max_coordinate(const struct spine *s)
{
	double max = 0;
	for (int k = 0; k < 3; k++)
		max = fmax(max, fmax(fabs(s->box_min[k]), fabs(s->box_max[k])));
	return max;
}

static void measure_triangles(struct spine *s, const struct accel_shape *mesh)
{
	for (uint32_t i = 0; i < mesh->triangle_count; i++) {
		const struct triangle t = accel_triangle(mesh, i, 0);
		double n = vec3_length(t.n), height = triangle_altitude(&t);
		s->min_altitude = fmin(s->min_altitude, height);
		s->max_lean = n > 0 ? fmax(s->max_lean, fabs(vec3_dot(t.n, s->direction)) / n) : 1;
	}
}

struct spine spine_make(const struct accel_shape *mesh)
{
	struct spine s = {.box_min = {INFINITY, INFINITY, INFINITY},
			  .box_max = {-INFINITY, -INFINITY, -INFINITY},
			  .min_altitude = INFINITY};
	for (uint32_t i = 0; i < mesh->vertex_count; i++)
		add_to_box(&s, triangle_vertex(mesh->position, i));
	vec3 center = box_middle(&s),
	     start = {s.box_max[0] - s.box_min[0], s.box_max[1] - s.box_min[1], s.box_max[2] - s.box_min[2]};
	/* The start is not exactly along a diagonal of the box, since that could be perpendicular to
	 * the direction looked for. */
	start = vec3_add(start, (vec3){0.37 * start.y, -0.41 * start.z, 0.43 * start.x});
	double length = vec3_length(start), max = max_coordinate(&s);
	if (length >= DBL_MIN)
		s.direction = main_direction(mesh, center, vec3_scale(1 / length, start));
	fit_segment(&s, mesh, center);
	measure_triangles(&s, mesh);
	s.rounding = max * 0x1p-23;
	double margin = max * 0x1p-20;
	s.radius += margin;
	for (int k = 0; k < 3; k++) {
		s.box_min[k] -= margin;
		s.box_max[k] += margin;
	}
	return s;
}

bool spine_clip(const struct spine *s, const double low[3], const double high[3], struct spine_part *part)
{
	*part = (struct spine_part){0, 1};
	for (unsigned k = 0; k < 3; k++) {
		double origin = vec3_component(s->start, k), d = vec3_component(s->span, k), min = low[k] - s->radius,
		       max = high[k] + s->radius;
		if (s->box_max[k] < low[k] || s->box_min[k] > high[k])
			return false;
		/* Along this axis the segment does not leave the box, or by no more than the margin in its radius. */
		if (fmin(origin, origin + d) >= min && fmax(origin, origin + d) <= max)
			continue;
		if (!(fabs(d) > 0x1p-24 * s->radius)) {
			if (origin > max + fabs(d) || origin < min - fabs(d))
				return false;
			continue;
		}
		double t = (min - origin) / d, u = (max - origin) / d;
		part->first = fmax(part->first, fmin(t, u));
		part->last = fmin(part->last, fmax(t, u));
	}
	return part->first <= part->last;
}

void spine_extent(const struct spine *s, struct spine_part part, unsigned axis, double *low, double *high)
{
	double origin = vec3_component(s->start, axis), d = vec3_component(s->span, axis), t = origin + part.first * d,
	       u = origin + part.last * d;
	*low = fmax(fmin(t, u) - s->radius, s->box_min[axis]);
	*high = fmin(fmax(t, u) + s->radius, s->box_max[axis]);
}

static double clamp_unit(double t)
{
	return fmin(fmax(t, 0), 1);
}

/* Returns the least squared distance of two segments. */
static double segment_distance2(vec3 p, vec3 d, vec3 q, vec3 e)
{
	vec3 r = vec3_sub(p, q);
	double a = vec3_dot(d, d), b = vec3_dot(d, e), c = vec3_dot(e, e), f = vec3_dot(d, r), g = vec3_dot(e, r),
	       slope = a * c - b * b, min = INFINITY;
	/* The point where the lines are nearest, then the nearest point to each end. Only the latter count where the
	 * former lies outside the segments or the lines are parallel. */
	const double ends[5][2] = {
		{slope > 0 ? clamp_unit((b * g - c * f) / slope) : 0, NAN}, {0, NAN}, {1, NAN}, {NAN, 0}, {NAN, 1}};
	for (int i = 0; i < 5; i++) {
		double t = ends[i][0], u = ends[i][1];
		if (i < 3)
			u = c > 0 ? clamp_unit((b * t + g) / c) : 0;
		else
			t = a > 0 ? clamp_unit((b * u - f) / a) : 0;
		vec3 between = vec3_add(r, vec3_sub(vec3_scale(t, d), vec3_scale(u, e)));
		min = fmin(min, vec3_dot(between, between));
	}
	return min;
}

bool spines_may_meet(const struct spine *a, struct spine_part part, const struct spine *b, struct spine_part other)
{
	double radius_sum = a->radius + b->radius;
	vec3 p = vec3_madd(a->start, part.first, a->span), q = vec3_madd(b->start, other.first, b->span);
	return segment_distance2(p, vec3_scale(part.last - part.first, a->span), q,
				 vec3_scale(other.last - other.first, b->span)) <= radius_sum * radius_sum;
}

double spine_max_parallel_lean(const struct spine *s, const struct spine *other)
{
	double min_altitude = fmin(s->min_altitude, other->min_altitude),
	       shift = 1.5 * COINCIDE_TILT * (s->rounding + other->rounding);
	/* Unit normals at an angle differ by at most sqrt(2) times its sine, up to the sign. */
	return shift < min_altitude ? s->max_lean + shift / min_altitude : 2;
}
