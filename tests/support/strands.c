/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/strands.h"

#include <string.h>

void strand_init(struct strand *s)
{
	memset(s, 0, sizeof *s);
	s->curves.points = s->point;
	s->curves.cone = s->cone;
	s->curves.u_start = s->start;
	s->curves.v = s->v;
}

void strand_add(struct strand *s, vec3 p, double radius)
{
	uint32_t i = s->curves.point_count++;
	bool first = i == 0 || (s->curves.count > 0 && (s->cone[s->curves.count - 1] & CURVE_ENDS) &&
				s->cone[s->curves.count - 1] >> CURVE_SHIFT == i - 2);
	s->point[i][0] = (float)p.x;
	s->point[i][1] = (float)p.y;
	s->point[i][2] = (float)p.z;
	s->point[i][3] = (float)radius;
	s->v[i] = (float)i / 8;
	if (s->point[i][3] > s->curves.max_radius)
		s->curves.max_radius = s->point[i][3];
	if (first)
		return;
	uint32_t begins = i == 1 || s->curves.count == 0 || (s->cone[s->curves.count - 1] & CURVE_ENDS)
				  ? (uint32_t)CURVE_BEGINS
				  : 0;
	s->start[s->curves.count] = 0.125f;
	s->cone[s->curves.count++] = (i - 1) << CURVE_SHIFT | begins;
}

void strand_end_chain(struct strand *s)
{
	s->cone[s->curves.count - 1] |= CURVE_ENDS;
}

static vec3 center(const float p[4])
{
	return (vec3){(double)p[0], (double)p[1], (double)p[2]};
}

void strand_set_tangents(struct strand *s, double turn, struct dice *d)
{
	for (uint32_t i = 0; i < s->curves.point_count; i++) {
		vec3 before = center(s->point[i > 0 ? i - 1 : i]),
		     after = center(s->point[i + 1 < s->curves.point_count ? i + 1 : i]);
		vec3 t = vec3_madd(vec3_normalize(vec3_sub(after, before)), turn, dice_direction(d));
		t = vec3_normalize(t);
		s->tangent[i][0] = (float)t.x;
		s->tangent[i][1] = (float)t.y;
		s->tangent[i][2] = (float)t.z;
	}
	s->curves.tangent = s->tangent;
}

void strand_make_random(struct strand *s, uint32_t count, double turn, const double length[2], const double radius[2],
			struct dice *d)
{
	vec3 p = {0, 0, 0}, direction = dice_direction(d);
	strand_init(s);
	for (uint32_t i = 0; i < count; i++) {
		strand_add(s, p, dice_between(d, radius[0], radius[1]));
		p = vec3_madd(p, dice_between(d, length[0], length[1]), direction);
		vec3 other = dice_direction(d);
		other = vec3_normalize(vec3_madd(other, -vec3_dot(other, direction), direction));
		double angle = dice_between(d, 0, turn);
		direction = vec3_normalize(vec3_madd(vec3_scale(cos(angle), direction), sin(angle), other));
	}
	strand_end_chain(s);
}

double strand_cone_distance(const float a[4], const float b[4], vec3 p)
{
	/* Distance less radius is convex along the axis. */
	vec3 from = center(a), axis = vec3_sub(center(b), from);
	double low = 0, high = 1, r = (double)a[3], radius_change = (double)b[3] - r;
	for (int i = 0; i < 120; i++) {
		double x = low + (high - low) / 3, y = high - (high - low) / 3;
		double f = vec3_length(vec3_sub(p, vec3_madd(from, x, axis))) - r - x * radius_change,
		       g = vec3_length(vec3_sub(p, vec3_madd(from, y, axis))) - r - y * radius_change;
		if (f <= g)
			high = y;
		else
			low = x;
	}
	return vec3_length(vec3_sub(p, vec3_madd(from, low, axis))) - r - low * radius_change;
}

double strand_distance(const struct strand *s, vec3 p)
{
	double min_distance = INFINITY;
	for (uint32_t i = 0; i < s->curves.count; i++) {
		uint32_t k = s->cone[i] >> CURVE_SHIFT;
		min_distance = fmin(min_distance, strand_cone_distance(s->point[k], s->point[k + 1], p));
	}
	return min_distance;
}
