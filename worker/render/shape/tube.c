/* SPDX-License-Identifier: Apache-2.0 */
/*
 * tube_add collects rings, and tube_mesh connects each ring with the next by two triangles per side.
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

int tube_add(struct list *rings, const struct tube_ring *r)
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

struct sphere_at {
	vec3 center;
	double radius, v;
};

/* Adds a ring on the sphere at the angle a from the equator, in the direction of the axis. */
static int add_circle(struct list *rings, const struct sphere_at *s, vec3 axis, double a, bool first)
{
	bool pole = fabs(a) >= pi / 2;
	double sin_a = pole ? copysign(1, a) : sin(a), cos_a = pole ? 0 : cos(a);
	return tube_add(rings, &(struct tube_ring){.center = vec3_madd(s->center, s->radius * sin_a, axis),
						   .axis = axis,
						   .radius = s->radius * cos_a,
						   .cos = cos_a,
						   .sin = sin_a,
						   .v = s->v,
						   .first = first});
}

static unsigned steps_for(double angle)
{
	return (unsigned)fmax(1, ceil(fabs(angle) / (2 * pi / TUBE_SIDES)));
}

/* Adds rings from one angle to another around the same axis, without the one at `from` unless it is the first of the
 * tube. */
static int add_cap(struct list *rings, const struct sphere_at *s, vec3 axis, double from, double to, bool first)
{
	unsigned n = steps_for(to - from);
	int rc = first ? add_circle(rings, s, axis, from, true) : 0;
	for (unsigned i = 1; i <= n && !rc; i++)
		rc = add_circle(rings, s, axis, i == n ? to : from + (to - from) * i / n, false);
	return rc;
}

/* Adds the rings of the joint on s, after the ring at which the segment before it ends. */
static int add_joint(struct list *rings, const struct sphere_at *s, vec3 from, double a, vec3 to, double b)
{
	vec3 across = mesh_unit(vec3_madd(to, -vec3_dot(from, to), from));
	double turn = vec3_angle(from, to);
	if (vec3_length(across) == 0)
		across = frame_around(from).s;
	double way = fmax(turn, fabs(b - a));
	unsigned n = steps_for(way);
	int rc = 0;
	if (way < pi / TUBE_SIDES) { /* one ring suffices for both segments */
		rings->count--;
		return add_circle(rings, s, mesh_unit(vec3_add(from, to)), 0.5 * (a + b), false);
	}
	for (unsigned i = 1; i <= n && !rc; i++) {
		double x = (double)i / n;
		vec3 axis = vec3_madd(vec3_scale(cos(turn * x), from), sin(turn * x), across);
		rc = add_circle(rings, s, i == n ? to : mesh_unit(axis), i == n ? b : a + (b - a) * x, false);
	}
	return rc;
}

int tube_add_chain(struct list *rings, const double (*points)[4], uint32_t count, double v, double v_step)
{
	struct sphere_at s = {mesh_load(points[0]), points[0][3], v};
	vec3 axis = {0, 0, 1};
	double angle = 0;
	bool begun = false;
	int rc = 0;
	for (uint32_t i = 1; i < count && !rc; i++) {
		liveness_tick();
		struct sphere_at next = {mesh_load(points[i]), points[i][3], v + v_step * i};
		vec3 way = vec3_sub(next.center, s.center), to = mesh_unit(way);
		double length = vec3_length(way);
		if (!(length > 0)) { /* at the same position: keep the larger radius */
			s.radius = fmax(s.radius, next.radius);
			continue;
		}
		double a = asin(fmax(-1, fmin(1, (s.radius - next.radius) / length)));
		rc = begun ? add_joint(rings, &s, axis, angle, to, a) : add_cap(rings, &s, to, -pi / 2, a, true);
		if (!rc)
			rc = add_circle(rings, &next, to, a, false);
		begun = true;
		axis = to;
		angle = a;
		s = next;
	}
	if (!rc && !begun)
		rc = add_circle(rings, &s, axis, -pi / 2, true);
	return rc ? rc : add_cap(rings, &s, axis, begun ? angle : -pi / 2, pi / 2, false);
}

/* ---- the mesh ---- */

/* Returns the direction in which u is 0 at the start of a tube, as in Mitsuba. */
static vec3 direction_at_start(vec3 axis)
{
	vec3 up = mesh_unit((vec3){-axis.z * axis.x, -axis.z * axis.y, 1 - axis.z * axis.z});
	if (vec3_length(up) == 0)
		up = (vec3){0, 1, 0};
	return vec3_cross(up, axis);
}

/* Rotates a direction by the smallest rotation that turns one axis into the other. */
static vec3 transport_direction(vec3 direction, vec3 from, vec3 to)
{
	double sum = 1 + vec3_dot(from, to);
	if (!(sum > 0x1p-40)) /* opposite axes: the direction stays perpendicular */
		return direction;
	return mesh_unit(vec3_madd(direction, -vec3_dot(to, direction) / sum, vec3_add(from, to)));
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
		double outwards = fmax(1 - vec3_dot(offset, r->bend), 0.125) * r->cos;
		vec3 n = mesh_unit(vec3_madd(vec3_scale(outwards, e), r->sin, r->axis));
		mesh_set_vertex(m, first + i, vec3_add(r->center, offset), n, (double)i / TUBE_SIDES, r->v);
	}
}

static void set_sides(struct mesh *m, uint32_t triangle, uint32_t before, uint32_t first)
{
	for (uint32_t i = 0; i < TUBE_SIDES; i++) {
		uint32_t *a = m->index[triangle + 2 * i], *b = m->index[triangle + 2 * i + 1];
		a[0] = b[0] = before + i;
		a[1] = before + i + 1;
		a[2] = b[1] = first + i + 1;
		b[2] = first + i;
	}
}

int tube_mesh(const struct list *rings, struct arena *arena, struct mesh *out)
{
	const struct tube_ring *ring = rings->items;
	uint32_t tubes = 0, triangle = 0, count = (uint32_t)rings->count;
	for (uint32_t i = 0; i < count; i++)
		tubes += ring[i].first;
	if (!mesh_alloc(out, count * (TUBE_SIDES + 1), 2 * TUBE_SIDES * (count - tubes), true, true, arena))
		return -ENOMEM;
	vec3 start = {0, 0, 0};
	for (uint32_t i = 0; i < count; i++) {
		const struct tube_ring *r = &ring[i];
		uint32_t first = i * (TUBE_SIDES + 1);
		liveness_tick();
		start = r->first ? direction_at_start(r->axis) : transport_direction(start, r[-1].axis, r->axis);
		set_ring(out, first, r, start);
		if (r->first)
			continue;
		set_sides(out, triangle, first - (TUBE_SIDES + 1), first);
		triangle += 2 * TUBE_SIDES;
	}
	return 0;
}
