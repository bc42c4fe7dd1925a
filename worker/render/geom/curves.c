/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Rays and points on curves.
 *
 * A ray meets a primitive where it meets the sphere or cone of a part, if the point is in that part and not inside
 * a neighbour. In double, both conditions are uncertain by rounding: each part is therefore extended a little
 * beyond its border, and a point inside a neighbour by less than that is not hidden. So at a joint the parts of
 * two cones overlap in a strip as wide as that rounding; a ray from a point in the strip is on both parts, and
 * both roots are divided out.
 *
 * Nothing fails.
 */
#include "worker/render/geom/curves.h"

#include "worker/render/geom/triangle.h"

/* Bounds the errors of a dozen operations, relative to the sum of the coordinates. */
#define ROUNDING 0x1p-44
enum { NEIGHBOURS_MAX = 32 };

vec3 curves_center(const struct curves *c, uint32_t i)
{
	return (vec3){(double)c->points[i][0], (double)c->points[i][1], (double)c->points[i][2]};
}

struct cone curves_cone(const struct curves *c, uint32_t prim)
{
	uint32_t i = c->cone[prim] >> CURVE_SHIFT;
	return cone_between(curves_center(c, i), (double)c->points[i][3], curves_center(c, i + 1),
			    (double)c->points[i + 1][3]);
}

void curves_box(const struct curves *c, uint32_t prim, vec3 *low, vec3 *high)
{
	uint32_t i = c->cone[prim] >> CURVE_SHIFT;
	vec3 a = curves_center(c, i), b = curves_center(c, i + 1);
	double r = (double)c->points[i][3], s = (double)c->points[i + 1][3];
	*low = (vec3){fmin(a.x - r, b.x - s), fmin(a.y - r, b.y - s), fmin(a.z - r, b.z - s)};
	*high = (vec3){fmax(a.x + r, b.x + s), fmax(a.y + r, b.y + s), fmax(a.z + r, b.z + s)};
}

void curves_bounds(const struct curves *c, vec3 *low, vec3 *high)
{
	*low = (vec3){INFINITY, INFINITY, INFINITY};
	*high = vec3_neg(*low);
	for (uint32_t i = 0; i < c->point_count; i++) {
		vec3 p = curves_center(c, i);
		double r = (double)c->points[i][3];
		*low = (vec3){fmin(low->x, p.x - r), fmin(low->y, p.y - r), fmin(low->z, p.z - r)};
		*high = (vec3){fmax(high->x, p.x + r), fmax(high->y, p.y + r), fmax(high->z, p.z + r)};
	}
}

static bool is_open_at(const struct curves *c, uint32_t prim, uint32_t end)
{
	return c->is_open && (c->cone[prim] & end);
}

static bool has_part(const struct curves *c, uint32_t prim, enum cone_part part)
{
	if (part == CONE_START)
		return !is_open_at(c, prim, CURVE_BEGINS);
	return part == CONE_SIDE || (!c->is_open && (c->cone[prim] & CURVE_ENDS));
}

/* ---- neighbours ---- */

static bool is_inside(const struct curves *c, uint32_t prim, const struct cone *k, vec3 p, double slack)
{
	return cone_distance(k, p, is_open_at(c, prim, CURVE_BEGINS), is_open_at(c, prim, CURVE_ENDS)) < -slack;
}

/* Whether p, on this primitive, lies inside a primitive that follows (step 1) or precedes it (step -1). */
static bool is_hidden_along(const struct curves *c, uint32_t prim, double radius, vec3 p, double slack, int step)
{
	double gap = 0;
	uint32_t last = step > 0 ? CURVE_ENDS : CURVE_BEGINS;
	for (int i = 0; i < NEIGHBOURS_MAX && !(c->cone[prim] & last); i++) {
		prim += (uint32_t)step;
		struct cone k = curves_cone(c, prim);
		if (gap > 2 * (radius + (double)c->max_radius))
			return false;
		if (gap <= 2 * (radius + fmax(k.r0, k.r1)) && is_inside(c, prim, &k, p, slack))
			return true;
		gap += k.length;
	}
	return false;
}

static bool is_hidden(const struct curves *c, uint32_t prim, const struct cone *k, vec3 p, double slack)
{
	double radius = fmax(k->r0, k->r1);
	return is_hidden_along(c, prim, radius, p, slack, 1) || is_hidden_along(c, prim, radius, p, slack, -1);
}

/* ---- rays ---- */

enum { CANDIDATES_MAX = 2 * CONE_PARTS };

struct intersection {
	const struct curves *curves;
	const struct curve_ray *ray;
	uint32_t prim;
	struct cone cone;
	double slack;
	int count;
	struct curve_crossing crossings[CANDIDATES_MAX];
};

static void add_crossing(struct intersection *m, enum cone_part part, int root, double t)
{
	if (t > m->ray->t_min && t < m->ray->t_max && isfinite(t))
		m->crossings[m->count++] = (struct curve_crossing){t, part, root};
}

/* Returns the parts on which p is, one bit each. origin_prim: the primitive on which p was computed; if it is this one,
 * p is on at least the nearest part, whatever the rounding. */
static unsigned parts_containing(const struct intersection *m, vec3 p, uint32_t origin_prim)
{
	unsigned parts = 0, nearest = 0;
	double min_distance = INFINITY;
	for (enum cone_part part = 0; part < CONE_PARTS; part++) {
		if (!has_part(m->curves, m->prim, part) || (part == CONE_SIDE && !(m->cone.cos > 0)))
			continue;
		double distance = fabs(cone_height(&m->cone, part, p));
		if (distance <= m->slack)
			parts |= 1u << part;
		if (distance < min_distance) {
			min_distance = distance;
			nearest = 1u << part;
		}
	}
	return origin_prim == m->prim ? parts | nearest : parts;
}

static void find_candidates(struct intersection *m)
{
	const struct curve_ray *r = m->ray;
	unsigned starts = r->starts_on_curve ? parts_containing(m, r->o, r->start_prim) : 0,
		 ends = r->ends_on_curve ? parts_containing(m, r->end, r->end_prim) : 0;
	for (enum cone_part part = 0; part < CONE_PARTS; part++) {
		unsigned bit = 1u << part;
		double root[2];
		if (!has_part(m->curves, m->prim, part) || (starts & ends & bit))
			continue;
		if (starts & bit) {
			double t = cone_other_root(&m->cone, part, r->o, r->d);
			add_crossing(m, part, t > 0, t);
		} else if (ends & bit) {
			double t = cone_other_root(&m->cone, part, r->end, r->d);
			add_crossing(m, part, t > 0, 1 + t);
		} else if (cone_roots(&m->cone, part, r->o, r->d, root)) {
			add_crossing(m, part, 0, root[0]);
			add_crossing(m, part, 1, root[1]);
		}
	}
}

/* Whether the ray's line passes the line of the axis at a distance of more than the larger radius. Most rays that enter
 * a primitive's box end here. */
static bool misses_cone(const struct curves *c, uint32_t prim, const struct curve_ray *r)
{
	uint32_t i = c->cone[prim] >> CURVE_SHIFT;
	vec3 p = curves_center(c, i), away = vec3_sub(p, r->o),
	     across = vec3_cross(r->d, vec3_sub(curves_center(c, i + 1), p));
	double radius = fmax((double)c->points[i][3], (double)c->points[i + 1][3]),
	       slack = radius + ROUNDING * (triangle_norm1(r->o) + triangle_norm1(p) + radius),
	       volume = vec3_dot(away, across);
	return volume * volume > slack * slack * vec3_dot(across, across);
}

static void begin_intersection(struct intersection *m, const struct curves *c, uint32_t prim, const struct curve_ray *r)
{
	m->curves = c;
	m->ray = r;
	m->prim = prim;
	m->cone = curves_cone(c, prim);
	m->count = 0;
	m->slack = ROUNDING *
		   (triangle_norm1(r->o) + triangle_norm1(m->cone.p0) + m->cone.length + m->cone.r0 + m->cone.r1);
	find_candidates(m);
}

/* Whether the ray leaves the curve at a point p of that part. */
static bool is_leaving(const struct intersection *m, enum cone_part part, vec3 p)
{
	const struct cone *k = &m->cone;
	vec3 q = vec3_sub(p, k->p0), d = m->ray->d;
	double y = vec3_dot(q, k->axis);
	vec3 away = vec3_madd(q, -y, k->axis);
	if (part == CONE_START)
		return vec3_dot(q, d) > 0;
	if (part == CONE_END)
		return vec3_dot(vec3_madd(q, -k->length, k->axis), d) > 0;
	return k->cos * vec3_dot(away, d) + k->sin * vec3_length(away) * vec3_dot(k->axis, d) > 0;
}

/* Whether a crossing is in its part, not culled and not hidden. */
static bool is_valid_crossing(const struct intersection *m, const struct curve_crossing *x)
{
	vec3 p = vec3_madd(m->ray->o, x->t, m->ray->d);
	return cone_part_contains(&m->cone, x->part, p, m->slack) &&
	       !(m->ray->culls_backfaces && is_leaving(m, x->part, p)) &&
	       !is_hidden(m->curves, m->prim, &m->cone, p, m->slack);
}

bool curves_intersect_near(const struct curves *c, uint32_t prim, const struct curve_ray *r, double t_near,
			   struct curve_crossing *x)
{
	struct intersection m;
	if (misses_cone(c, prim, r))
		return false;
	begin_intersection(&m, c, prim, r);
	while (m.count > 0) {
		int best = 0;
		for (int i = 1; i < m.count; i++)
			if (fabs(m.crossings[i].t - t_near) < fabs(m.crossings[best].t - t_near))
				best = i;
		if (is_valid_crossing(&m, &m.crossings[best])) {
			*x = m.crossings[best];
			return true;
		}
		m.crossings[best] = m.crossings[--m.count];
	}
	return false;
}

bool curves_intersect(const struct curves *c, uint32_t prim, const struct curve_ray *r, struct curve_crossing *x)
{
	return curves_intersect_near(c, prim, r, r->t_min, x);
}

/* ---- points ---- */

/* Computes Mitsuba's directions perpendicular to the axis: u is counted from `from` towards `to`. */
static void axis_directions(vec3 axis, vec3 *from, vec3 *to)
{
	vec3 up = {-axis.z * axis.x, -axis.z * axis.y, 1 - axis.z * axis.z};
	double length = vec3_length(up);
	*to = length > 0 ? vec3_scale(1 / length, up) : (vec3){0, 1, 0};
	*from = vec3_cross(*to, axis);
}

/* Rotates a direction by the smallest rotation that turns the axis `from` into `to`. */
static vec3 transport_direction(vec3 direction, vec3 from, vec3 to)
{
	double sum = 1 + vec3_dot(from, to);
	if (!(sum > 0x1p-40)) /* opposite axes: the direction stays perpendicular */
		return direction;
	return vec3_madd(direction, -vec3_dot(to, direction) / sum, vec3_add(from, to));
}

void curves_compute_u_starts(struct curves *c)
{
	vec3 u = {0, 0, 0}, axis = {0, 0, 1}, from, to;
	for (uint32_t i = 0; i < c->count; i++) {
		struct cone k = curves_cone(c, i);
		axis_directions(k.axis, &from, &to);
		u = c->cone[i] & CURVE_BEGINS ? from : transport_direction(u, axis, k.axis);
		axis = k.axis;
		c->u_start[i] = (float)(atan2(vec3_dot(u, to), vec3_dot(u, from)) / (2 * M_PI));
	}
}

static double lean_angle(const struct cone *c)
{
	return atan2(c->sin, c->cos);
}

struct curve_coordinates curves_coordinates(const struct cone *c, enum cone_part part, vec3 p)
{
	vec3 q = vec3_sub(p, c->p0), from, to;
	axis_directions(c->axis, &from, &to);
	double y = vec3_dot(q, c->axis), x = vec3_length(vec3_madd(q, -y, c->axis));
	struct curve_coordinates coordinates = {0, atan2(vec3_dot(q, to), vec3_dot(q, from))};
	if (part == CONE_START)
		coordinates.along = fmin(atan2(y, x) - lean_angle(c), 0);
	else if (part == CONE_END)
		coordinates.along = 1 + fmax(atan2(y - c->length, x) - lean_angle(c), 0);
	else
		coordinates.along = fmin(fmax((c->cos * y - c->sin * x) / (c->cos * c->length), 0), 1);
	return coordinates;
}

struct curve_coordinates curves_nearest_coordinates(const struct curves *c, uint32_t prim, vec3 p)
{
	struct cone k = curves_cone(c, prim);
	vec3 q = vec3_sub(p, k.p0);
	double y = vec3_dot(q, k.axis), x = vec3_length(vec3_madd(q, -y, k.axis)), slope = k.cos * y - k.sin * x;
	enum cone_part part = CONE_SIDE;
	if (!(k.cos > 0))
		part = k.sin > 0 ? CONE_START : CONE_END;
	else if (slope < 0 && has_part(c, prim, CONE_START))
		part = CONE_START;
	else if (slope > k.cos * k.length && has_part(c, prim, CONE_END))
		part = CONE_END;
	return curves_coordinates(&k, part, p);
}

bool curves_have_point(const struct curves *c, uint32_t prim, struct curve_coordinates coordinates)
{
	if (prim >= c->count || !(fabs(coordinates.around) <= M_PI))
		return false;
	struct cone k = curves_cone(c, prim);
	double slack = 0x1p-50, lean = lean_angle(&k);
	if (coordinates.along < 0)
		return has_part(c, prim, CONE_START) && lean + coordinates.along >= -M_PI / 2 - slack;
	if (coordinates.along > 1)
		return has_part(c, prim, CONE_END) && lean + coordinates.along - 1 <= M_PI / 2 + slack;
	return k.cos > 0 && coordinates.along >= 0;
}

static void set_texture_coordinates(const struct curves *c, uint32_t prim, double around, struct curve_point *p)
{
	uint32_t i = c->cone[prim] >> CURVE_SHIFT;
	double u = around / (2 * M_PI) - (double)c->u_start[prim];
	p->u = u - floor(u);
	p->v = (1 - p->side_position) * (double)c->v[i] + p->side_position * (double)c->v[i + 1];
}

void curves_compute_point(const struct curves *c, uint32_t prim, struct curve_coordinates coordinates,
			  struct curve_point *p)
{
	const struct cone k = curves_cone(c, prim);
	vec3 from, to;
	axis_directions(k.axis, &from, &to);
	p->cone = k;
	p->part = coordinates.along < 0 ? CONE_START : coordinates.along > 1 ? CONE_END : CONE_SIDE;
	p->side_position = fmin(fmax(coordinates.along, 0), 1);
	p->radial = vec3_madd(vec3_scale(cos(coordinates.around), from), sin(coordinates.around), to);
	p->side = vec3_cross(k.axis, p->radial);
	double cosine = k.cos, sine = k.sin, radius = (1 - p->side_position) * k.r0 + p->side_position * k.r1;
	if (p->part != CONE_SIDE) {
		double angle = lean_angle(&k) + (coordinates.along - p->side_position);
		cosine = fmax(cos(angle), 0);
		sine = sin(angle);
	}
	p->n = vec3_normalize(vec3_madd(vec3_scale(cosine, p->radial), sine, k.axis));
	p->up = vec3_madd(vec3_scale(cosine, k.axis), -sine, p->radial);
	p->axis_distance = radius * cosine;
	p->p = vec3_madd(vec3_madd(k.p0, p->side_position * k.length, k.axis), radius, p->n);
	set_texture_coordinates(c, prim, coordinates.around, p);
}
