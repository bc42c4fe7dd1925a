/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `perspective_rdist` of 0.5/0.6: a pinhole with radial distortion. A point that `perspective` images at the slope r
 * from the axis is imaged at the slope
 *
 *     d(r) = r (1 + kc_0 r^2 + kc_1 r^4),
 *
 * in the same direction from the axis. The pixels per solid angle are d(r) d'(r) / r times those of `perspective`.
 * Beyond the slope at which d' is 0 the image would fold over: it ends there, and a film that reaches further is
 * refused.
 */
#include "worker/render/camera/camera.h"
#include "worker/render/camera/projection.h"

static double radial_factor(const struct camera *c, double r2)
{
	return 1 + r2 * (c->kc[0] + r2 * c->kc[1]);
}

static double radial_derivative(const struct camera *c, double r2)
{
	return 1 + r2 * (3 * c->kc[0] + 5 * r2 * c->kc[1]);
}

/* Returns the smallest positive r2 at which the derivative is 0; INFINITY if there is none. */
static double fold_slope_squared(const struct camera *c)
{
	double a = 5 * c->kc[1], b = 3 * c->kc[0], root = b * b - 4 * a;
	if (!(root >= 0))
		return INFINITY;
	/* Both roots are 2 / (-b -+ sqrt(root)); cancellation does not matter for the edge of an image. */
	double one = 2 / (-b - sqrt(root)), other = 2 / (-b + sqrt(root));
	double smallest = fmin(one > 0 ? one : INFINITY, other > 0 ? other : INFINITY);
	return smallest;
}

static int init(struct camera *c, const struct scene_settings *s, struct error *e)
{
	c->kc[0] = s->distortion[0];
	c->kc[1] = s->distortion[1];
	c->fold_slope_squared = fold_slope_squared(c);
	double x = fmax(c->center_x, c->width - c->center_x) + s->border,
	       y = fmax(c->center_y, c->height - c->center_y) + s->border, corner = hypot(x, y) / c->pixels_per_slope,
	       end_slope = isfinite(c->fold_slope_squared)
				   ? sqrt(c->fold_slope_squared) * radial_factor(c, c->fold_slope_squared)
				   : INFINITY;
	return corner < end_slope
		       ? 0
		       : error_set(e, EINVAL,
				   "the sensor's kc folds the image over at the slope %g, but its corner is at %g",
				   end_slope, corner);
}

static bool direction(const struct camera *c, double film_x, double film_y, vec3 *l)
{
	double x = (film_x - c->center_x) / c->pixels_per_slope, y = (film_y - c->center_y) / c->pixels_per_slope,
	       d = hypot(x, y);
	if (!(d > 0)) {
		*l = (vec3){0, 0, 1};
		return true;
	}
	/* Newton's method, kept inside the bracket [low, high]. */
	double low = 0, high = isfinite(c->fold_slope_squared) ? sqrt(c->fold_slope_squared) : 2 * d, r = fmin(d, high);
	while (!isfinite(c->fold_slope_squared) && high * radial_factor(c, high * high) < d)
		high *= 2;
	enum { STEPS = 100 };
	for (int i = 0; i < STEPS && low < high; i++) {
		double residual = r * radial_factor(c, r * r) - d, next = r - residual / radial_derivative(c, r * r);
		if (residual > 0)
			high = r;
		else
			low = r;
		if (!(next > low && next < high))
			next = 0.5 * (low + high);
		if (fabs(next - r) <= 0x1p-52 * r)
			break;
		r = next;
	}
	*l = (vec3){r * x / d, r * y / d, 1};
	return true;
}

static bool project(const struct camera *c, vec3 l, double *film_x, double *film_y)
{
	double x = l.x / l.z, y = l.y / l.z, r2 = x * x + y * y;
	if (!(r2 < c->fold_slope_squared))
		return false;
	*film_x = c->center_x + c->pixels_per_slope * radial_factor(c, r2) * x;
	*film_y = c->center_y + c->pixels_per_slope * radial_factor(c, r2) * y;
	return isfinite(*film_x) && isfinite(*film_y);
}

static double jac_film_from_solid(const struct camera *c, vec3 l)
{
	double r2 = (l.x * l.x + l.y * l.y) / (l.z * l.z);
	return c->pixels_per_slope * c->pixels_per_slope / (l.z * l.z * l.z) * radial_factor(c, r2) *
	       radial_derivative(c, r2);
}

const struct camera_projection camera_projection_rdist = {
	.init = init,
	.direction = direction,
	.project = project,
	.jac_film_from_solid = jac_film_from_solid,
};
