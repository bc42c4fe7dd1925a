/* SPDX-License-Identifier: Apache-2.0 */
/*
 * tube_add_ring collects rings, and tube_make_mesh connects each ring with the next by two triangles per side.
 *
 * All rings of tube_add_chain lie on the spheres around its points. For a segment with axis t, length L and radii r0
 * and r1, the cone touches both spheres at the angle a from their equators, sin a = (r0 - r1) / L. The ring on a sphere
 * of radius r is therefore at r sin a along t and has the radius r cos a; its normals are those of the sphere. At a
 * joint, t and a change in steps from those of one segment to those of the next, which covers the visible part of the
 * sphere; at an end, a changes from or to the pole. If one sphere contains the next, a is 90 degrees, and the cone
 * vanishes.
 *
 * Fails if memory is out, or if there are more triangles than a mesh may have.
 */
#include "worker/render/shape/tube.h"

#include "common/base/liveness.h"
#include "worker/render/math/frame.h"

static const double pi = 3.14159265358979323846;

int tube_add_ring(struct list *rings, const struct tube_ring *r)
{
	if (rings->count >= MESH_TRIANGLES_MAX / (2 * TUBE_SIDES))
		return -EFBIG;
	struct tube_ring *new = list_push(rings);
	if (!new)
		return -ENOMEM;
	*new = *r;
	return 0;
}

/* ---- chains of cones ---- */

struct joint_sphere {
	vec3 center;
	double radius, v;
};

/* Adds a ring on the sphere at the angle a from the equator, in the direction of the axis. */
static int add_circle(struct list *rings, const struct joint_sphere *s, vec3 axis, double a, bool first)
{
	bool pole = fabs(a) >= pi / 2;
	double sin_a = pole ? copysign(1, a) : sin(a), cos_a = pole ? 0 : cos(a);
	return tube_add_ring(rings, &(struct tube_ring){.center = vec3_madd(s->center, s->radius * sin_a, axis),
							.axis = axis,
							.radius = s->radius * cos_a,
							.normal_cos = cos_a,
							.normal_sin = sin_a,
							.v = s->v,
							.starts_tube = first});
}

static unsigned ring_count(double angle)
{
	return (unsigned)fmax(1, ceil(fabs(angle) / (2 * pi / TUBE_SIDES)));
}

/* Adds rings from one angle to another around the same axis, without the one at `from_angle` unless it is the first of
 * the tube. */
static int add_cap(struct list *rings, const struct joint_sphere *s, vec3 axis, double from_angle, double to_angle,
		   bool first)
{
	unsigned n = ring_count(to_angle - from_angle);
	int rc = first ? add_circle(rings, s, axis, from_angle, true) : 0;
	for (unsigned i = 1; i <= n && !rc; i++)
		rc = add_circle(rings, s, axis, i == n ? to_angle : from_angle + (to_angle - from_angle) * i / n,
				false);
	return rc;
}

/* Adds the rings of the joint on s, after the ring at which the segment before it ends. */
static int add_joint(struct list *rings, const struct joint_sphere *s, vec3 from_axis, double from_angle, vec3 to_axis,
		     double to_angle)
{
	vec3 across = vec3_unit_or_zero(vec3_madd(to_axis, -vec3_dot(from_axis, to_axis), from_axis));
	double axis_angle = vec3_angle(from_axis, to_axis);
	if (vec3_length(across) == 0)
		across = frame_around(from_axis).s;
	double max_turn = fmax(axis_angle, fabs(to_angle - from_angle));
	unsigned n = ring_count(max_turn);
	int rc = 0;
	if (max_turn < pi / TUBE_SIDES) { /* one ring suffices for both segments */
		rings->count--;
		return add_circle(rings, s, vec3_unit_or_zero(vec3_add(from_axis, to_axis)),
				  0.5 * (from_angle + to_angle), false);
	}
	for (unsigned i = 1; i <= n && !rc; i++) {
		double x = (double)i / n;
		vec3 axis = vec3_madd(vec3_scale(cos(axis_angle * x), from_axis), sin(axis_angle * x), across);
		rc = add_circle(rings, s, i == n ? to_axis : vec3_unit_or_zero(axis),
				i == n ? to_angle : from_angle + (to_angle - from_angle) * x, false);
	}
	return rc;
}

int tube_add_chain(struct list *rings, const double (*points)[4], uint32_t count, double v, double v_step)
{
	struct joint_sphere s = {vec3_load(points[0]), points[0][3], v};
	vec3 axis = {0, 0, 1};
	double angle = 0;
	bool has_rings = false;
	int rc = 0;
	for (uint32_t i = 1; i < count && !rc; i++) {
		liveness_tick();
		struct joint_sphere next = {vec3_load(points[i]), points[i][3], v + v_step * i};
		vec3 segment = vec3_sub(next.center, s.center), direction = vec3_unit_or_zero(segment);
		double length = vec3_length(segment);
		if (!(length > 0)) { /* at the same position: keep the larger radius */
			s.radius = fmax(s.radius, next.radius);
			continue;
		}
		double a = asin(fmax(-1, fmin(1, (s.radius - next.radius) / length)));
		rc = has_rings ? add_joint(rings, &s, axis, angle, direction, a)
			       : add_cap(rings, &s, direction, -pi / 2, a, true);
		if (!rc)
			rc = add_circle(rings, &next, direction, a, false);
		has_rings = true;
		axis = direction;
		angle = a;
		s = next;
	}
	if (!rc && !has_rings)
		rc = add_circle(rings, &s, axis, -pi / 2, true);
	return rc ? rc : add_cap(rings, &s, axis, has_rings ? angle : -pi / 2, pi / 2, false);
}

/* ---- the mesh ---- */

/* Returns the direction in which u is 0 at the start of a tube, as in Mitsuba. */
static vec3 start_direction(vec3 axis)
{
	vec3 up = vec3_unit_or_zero((vec3){-axis.z * axis.x, -axis.z * axis.y, 1 - axis.z * axis.z});
	if (vec3_length(up) == 0)
		up = (vec3){0, 1, 0};
	return vec3_cross(up, axis);
}

/* Rotates a direction by the smallest rotation that turns one axis into the other. */
static vec3 transport_direction(vec3 direction, vec3 from_axis, vec3 to_axis)
{
	double sum = 1 + vec3_dot(from_axis, to_axis);
	if (!(sum > 0x1p-40)) /* opposite axes: the direction stays perpendicular */
		return direction;
	return vec3_unit_or_zero(
		vec3_madd(direction, -vec3_dot(to_axis, direction) / sum, vec3_add(from_axis, to_axis)));
}

static void set_ring(struct mesh *m, uint32_t first, const struct tube_ring *r, vec3 start)
{
	const double scale = pi / TUBE_SIDES / sin(pi / TUBE_SIDES);
	vec3 side = vec3_cross(r->axis, start);
	for (uint32_t i = 0; i <= TUBE_SIDES; i++) {
		double angle = 2 * pi * (i % TUBE_SIDES) / TUBE_SIDES;
		vec3 e = vec3_madd(vec3_scale(cos(angle), start), sin(angle), side);
		vec3 offset = vec3_scale(scale * r->radius, e);
		/* On the inside of a bend narrower than the tube, which no ray reaches, the factor is kept positive. */
		double outwards = fmax(1 - vec3_dot(offset, r->curvature), 0.125) * r->normal_cos;
		vec3 n = vec3_unit_or_zero(vec3_madd(vec3_scale(outwards, e), r->normal_sin, r->axis));
		mesh_set_vertex(m, first + i, vec3_add(r->center, offset), n, (double)i / TUBE_SIDES, r->v);
	}
}

static void set_sides(struct mesh *m, uint32_t triangle, uint32_t previous_first, uint32_t first)
{
	for (uint32_t i = 0; i < TUBE_SIDES; i++) {
		uint32_t *a = m->index[triangle + 2 * i], *b = m->index[triangle + 2 * i + 1];
		a[0] = b[0] = previous_first + i;
		a[1] = previous_first + i + 1;
		a[2] = b[1] = first + i + 1;
		b[2] = first + i;
	}
}

int tube_make_mesh(const struct list *rings, struct arena *arena, struct mesh *out)
{
	const struct tube_ring *ring = rings->items;
	uint32_t tubes = 0, triangle = 0, count = (uint32_t)rings->count;
	for (uint32_t i = 0; i < count; i++)
		tubes += ring[i].starts_tube;
	if (!mesh_alloc(out, count * (TUBE_SIDES + 1), 2 * TUBE_SIDES * (count - tubes), true, true, arena))
		return -ENOMEM;
	vec3 start = {0, 0, 0};
	for (uint32_t i = 0; i < count; i++) {
		const struct tube_ring *r = &ring[i];
		uint32_t first = i * (TUBE_SIDES + 1);
		liveness_tick();
		start = r->starts_tube ? start_direction(r->axis) : transport_direction(start, r[-1].axis, r->axis);
		set_ring(out, first, r, start);
		if (r->starts_tube)
			continue;
		set_sides(out, triangle, first - (TUBE_SIDES + 1), first);
		triangle += 2 * TUBE_SIDES;
	}
	return 0;
}
