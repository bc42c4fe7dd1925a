/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Every four successive control points define a piece of the curve,
 *
 *   c(u) = ((1-u)^3 p0 + (3u^3 - 6u^2 + 4) p1 + (-3u^3 + 3u^2 + 3u + 1) p2 + u^3 p3) / 6,  0 <= u <= 1.
 *
 * With n chords per piece, chords deviate by at most max |c''| / (8 n^2), where c'' is linear in u, from p0 - 2 p1 + p2
 * to p1 - 2 p2 + p3. The radius is treated as a fourth coordinate. Normals at rings are exact.
 *
 * Fails if tube_add_ring does.
 */
#include "worker/render/shape/spline.h"

#include "common/base/liveness.h"

enum { CHORDS_MAX = 64 };

/* Computes the weighted sums of the positions and of the radii of four control points. */
static void weighted_sum(const double (*p)[4], const double w[SPLINE_POINTS], vec3 *c, double *r)
{
	*c = (vec3){0, 0, 0};
	*r = 0;
	for (int i = 0; i < SPLINE_POINTS; i++) {
		*c = vec3_madd(*c, w[i], vec3_load(p[i]));
		*r += w[i] * p[i][3];
	}
}

/* Returns the number of chords of a piece. tolerance: in units of the largest radius. */
static unsigned chord_count(const double (*p)[4], double tolerance)
{
	double max_difference = 0, max_radius = 0;
	for (int k = 0; k < 2; k++) {
		double sum = 0;
		for (int i = 0; i < 4; i++) {
			double d = p[k][i] - 2 * p[k + 1][i] + p[k + 2][i];
			sum += d * d;
		}
		max_difference = fmax(max_difference, sqrt(sum));
	}
	for (int i = 0; i < SPLINE_POINTS; i++)
		max_radius = fmax(max_radius, p[i][3]);
	double n = max_difference > 0 ? ceil(sqrt(max_difference / (8 * tolerance * max_radius))) : 1;
	return n >= 1 && n <= CHORDS_MAX ? (unsigned)n : n < 1 ? 1 : CHORDS_MAX;
}

/* Returns the ring at u of a piece. axis: that of the previous ring, used if the curve has no derivative here. */
static struct tube_ring ring_at(const double (*p)[4], double u, vec3 axis)
{
	double t = 1 - u;
	const double w[SPLINE_POINTS] = {t * t * t / 6, (3 * u * u * u - 6 * u * u + 4) / 6,
					 (-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6, u * u * u / 6},
		     first_derivative[SPLINE_POINTS] = {-t * t / 2, (3 * u * u - 4 * u) / 2,
							(-3 * u * u + 2 * u + 1) / 2, u * u / 2},
		     second_derivative[SPLINE_POINTS] = {t, 3 * u - 2, 1 - 3 * u, u};
	struct tube_ring r = {.normal_cos = 1};
	vec3 d, dd;
	double dr, unused;
	weighted_sum(p, w, &r.center, &r.radius);
	weighted_sum(p, first_derivative, &d, &dr);
	weighted_sum(p, second_derivative, &dd, &unused);
	double speed = vec3_length(d);
	r.axis = speed > 0 ? vec3_unit_or_zero(d) : axis;
	if (speed > 0 && speed * speed > 0) {
		double slope = -dr / speed, length = hypot(1, slope);
		r.normal_cos = 1 / length;
		r.normal_sin = slope / length;
		r.curvature = vec3_scale(1 / (speed * speed), dd);
	}
	return r;
}

/* Returns the direction of the first control point that differs from the start, in case the curve has no derivative at
 * its start. */
static vec3 first_axis(const double (*p)[4], uint32_t count)
{
	for (uint32_t i = 1; i < count; i++) {
		vec3 d = vec3_unit_or_zero(vec3_sub(vec3_load(p[i]), vec3_load(p[0])));
		if (vec3_length(d) > 0)
			return d;
	}
	return (vec3){0, 0, 1};
}

int spline_add_rings(struct list *rings, const double (*points)[4], uint32_t count, double tolerance, double v,
		     double v_step)
{
	vec3 axis = first_axis(points, count);
	int rc = 0;
	for (uint32_t i = 0; i + SPLINE_POINTS <= count && !rc; i++) {
		unsigned n = chord_count(points + i, tolerance);
		liveness_tick();
		for (unsigned k = i > 0; k <= n && !rc; k++) {
			struct tube_ring r = ring_at(points + i, (double)k / n, axis);
			r.starts_tube = i == 0 && k == 0;
			r.v = v + v_step * (i + (double)k / n);
			axis = r.axis;
			rc = tube_add_ring(rings, &r);
		}
	}
	return rc;
}
