/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Implements the pinhole and the lens in the camera's frame: right, down, forward. A camera with its own projection
 * (projection.h) delegates directions, film points and densities to it.
 *
 * camera_init fails if the transform is singular, a parameter is out of range, or the camera is too far away; nothing
 * else fails.
 */
#include "worker/render/camera/camera.h"

#include "worker/render/camera/projection.h"
#include "worker/render/scene/fov.h"

/* Returns the pixels per unit of slope. They are the same for both axes, so fov_axis only chooses the side of the film
 * that the field of view spans. */
static double pixels_per_slope(const struct scene_settings *s)
{
	return fov_side(s->fov_axis, s->width, s->height) / (2 * tan(s->fov * (M_PI / 360)));
}

/* Moves an orthographic camera, which is a pinhole, so far back that objects at twice the distance look smaller by
 * 2^-20 only, or a thousandth of a pixel in a film of 1,000. A telecentric camera is a lens at that distance; its
 * aperture is enlarged so that a point in the plane of focus sees it under the same solid angle as the real
 * aperture. */
static void step_back(struct camera *c, double half_width)
{
	double distance = 0x1p20 * fmax(1, half_width);
	c->position = vec3_madd(c->position, -distance, c->axes.n);
	c->near_clip += distance;
	c->far_clip += distance;
	c->pixels_per_slope = 0.5 * c->width * distance / half_width;
	if (c->aperture_radius > 0 && c->focus_distance > 0) {
		c->aperture_radius *= (distance + c->focus_distance) / c->focus_distance;
		c->focus_distance += distance;
	}
}

/* The axes are used as they are: a transform that mirrors gives a mirrored image, as in Mitsuba. */
static struct frame axes_from_transform(const mat4 *m)
{
	return (struct frame){vec3_neg(vec3_normalize(mat4_vector(m, (vec3){1, 0, 0}))),
			      vec3_neg(vec3_normalize(mat4_vector(m, (vec3){0, 1, 0}))),
			      vec3_normalize(mat4_vector(m, (vec3){0, 0, 1}))};
}

int camera_init(struct camera *c, const struct scene_settings *s, vec3 world_center, double world_scale,
		struct error *e)
{
	if (!(s->half_width > 0) && s->projection != PROJECTION_SPHERE && !(s->fov > 0 && s->fov < 180))
		return error_set(e, EINVAL, "the sensor's field of view of %g degrees is not between 0 and 180",
				 s->fov);
	const vec3 forward = mat4_vector(&s->to_world, (vec3){0, 0, 1}),
		   up = mat4_vector(&s->to_world, (vec3){0, 1, 0}), left = mat4_vector(&s->to_world, (vec3){1, 0, 0});
	double volume = fabs(vec3_dot(left, vec3_cross(up, forward)));
	if (!(volume > 0) || !isfinite(volume))
		return error_set(e, EINVAL, "the sensor's to_world transform is singular");
	c->axes = axes_from_transform(&s->to_world);
	c->position = vec3_scale(world_scale, vec3_sub(mat4_point(&s->to_world, (vec3){0, 0, 0}), world_center));
	c->width = s->width;
	c->height = s->height;
	c->center_x = s->width * (0.5 - s->principal_x);
	c->center_y = s->height * (0.5 - s->principal_y);
	c->projection = camera_projection_find(s->projection);
	c->pixels_per_slope = s->half_width > 0 || s->projection == PROJECTION_SPHERE ? 0 : pixels_per_slope(s);
	c->near_clip = s->near_clip * world_scale;
	c->far_clip = s->far_clip * world_scale;
	c->aperture_radius = s->aperture_radius * world_scale;
	c->focus_distance = s->focus_distance * world_scale;
	c->has_lens = c->aperture_radius > 0;
	if (s->half_width > 0)
		step_back(c, s->half_width * world_scale);
	double distance = vec3_length(c->position) + c->aperture_radius;
	if (!(distance <= PARAM_DISTANCE_MAX))
		return error_set(e, ERANGE, "the camera is %g scene radii away from the scene, more than %g", distance,
				 PARAM_DISTANCE_MAX);
	if (!(c->aperture_radius >= 0) || (c->aperture_radius > 0 && !(c->focus_distance > 0)))
		return error_set(e, EINVAL, "an aperture of radius %g cannot be focused at a distance of %g",
				 s->aperture_radius, s->focus_distance);
	return c->projection && c->projection->init ? c->projection->init(c, s, e) : 0;
}

void camera_move(const struct camera *c, double time, struct camera *out)
{
	mat4 to_world = motion_transform_at(c->motion, time);
	*out = *c;
	out->axes = axes_from_transform(&to_world);
	out->position = mat4_point(&to_world, (vec3){0, 0, 0});
}

bool camera_has_aperture(const struct camera *c)
{
#ifdef HSLT_PLAIN
	(void)c;
	return false;
#else
	return c->has_lens;
#endif
}

void camera_force_aperture(struct camera *c, bool on)
{
	c->has_lens = on;
	if (!on)
		c->aperture_radius = 0;
	else if (!(c->focus_distance > 0))
		c->focus_distance = 1; /* any value will do: every point is at the centre */
}

/* Maps the unit square to the unit disk: concentric squares become circles, and ratios of areas are preserved. */
static void disk_from_square(const double u[2], double *x, double *y)
{
	double a = 2 * u[0] - 1, b = 2 * u[1] - 1;
	bool wide = fabs(a) > fabs(b);
	double r = wide ? a : b, angle = r == 0 ? 0 : M_PI / 4 * (wide ? b : a) / r;
	*x = r * (wide ? cos(angle) : sin(angle));
	*y = r * (wide ? sin(angle) : cos(angle));
}

static void square_from_disk(double x, double y, double u[2])
{
	bool wide = fabs(x) > fabs(y);
	double r = copysign(hypot(x, y), wide ? x : y), angle = wide ? atan(y / x) : y == 0 ? 0 : atan(x / y);
	double other = r * (4 / M_PI) * angle;
	double a[2] = {wide ? r : other, wide ? other : r};
	for (int i = 0; i < 2; i++)
		u[i] = fmin(fmax(0.5 * (a[i] + 1), 0), 1 - 0x1p-53);
}

/* Computes the offset of x_k from the centre of the aperture, along the axes of the image. */
static void aperture_offset(const struct camera *c, vec3 x_k, double *x, double *y)
{
	vec3 offset = vec3_sub(x_k, c->position);
	*x = vec3_dot(c->axes.s, offset);
	*y = vec3_dot(c->axes.t, offset);
}

vec3 camera_sample_point(const struct camera *c, const double u[2])
{
	double x, y;
	if (!camera_has_aperture(c))
		return c->position;
	disk_from_square(u, &x, &y);
	return vec3_madd(vec3_madd(c->position, c->aperture_radius * x, c->axes.s), c->aperture_radius * y, c->axes.t);
}

void camera_point_inverse(const struct camera *c, vec3 p, double u[2])
{
	double x, y;
	u[0] = u[1] = 0.5;
	if (!(c->aperture_radius > 0))
		return;
	aperture_offset(c, p, &x, &y);
	square_from_disk(x / c->aperture_radius, y / c->aperture_radius, u);
}

bool camera_film_point_is_valid(const struct camera *c, double film_x, double film_y)
{
	vec3 unused;
	return !c->projection || c->projection->direction(c, film_x, film_y, &unused);
}

vec3 camera_direction(const struct camera *c, vec3 x_k, double film_x, double film_y)
{
	vec3 l = {0, 0, 1};
	if (c->projection) {
		c->projection->direction(c, film_x, film_y, &l);
		return vec3_normalize(frame_to_world(&c->axes, l));
	}
	l = (vec3){(film_x - c->center_x) / c->pixels_per_slope, (film_y - c->center_y) / c->pixels_per_slope, 1};
	if (camera_has_aperture(c)) {
		double x, y;
		aperture_offset(c, x_k, &x, &y);
		l.x -= x / c->focus_distance;
		l.y -= y / c->focus_distance;
	}
	return vec3_normalize(frame_to_world(&c->axes, l));
}

bool camera_project(const struct camera *c, vec3 x_k, vec3 d, double distance, double *film_x, double *film_y)
{
	vec3 l = frame_to_local(&c->axes, d);
	if (c->projection && c->projection->sees_all_directions)
		return c->projection->project(c, l, film_x, film_y);
	double depth = l.z * distance;
	if (!(l.z > 0) || depth < c->near_clip || depth > c->far_clip)
		return false;
	if (c->projection)
		return c->projection->project(c, l, film_x, film_y);
	double slope_x = l.x / l.z, slope_y = l.y / l.z;
	if (camera_has_aperture(c)) {
		double x, y;
		aperture_offset(c, x_k, &x, &y);
		slope_x += x / c->focus_distance;
		slope_y += y / c->focus_distance;
	}
	*film_x = c->center_x + c->pixels_per_slope * slope_x;
	*film_y = c->center_y + c->pixels_per_slope * slope_y;
	return isfinite(*film_x) && isfinite(*film_y);
}

double camera_jac_film_from_solid(const struct camera *c, vec3 d)
{
	if (c->projection)
		return c->projection->jac_film_from_solid(c, frame_to_local(&c->axes, d));
	double cosine = vec3_dot(c->axes.n, d);
	return c->pixels_per_slope * c->pixels_per_slope / (cosine * cosine * cosine);
}

bool camera_sees_direction(const struct camera *c, vec3 d)
{
	return (c->projection && c->projection->sees_all_directions) || vec3_dot(c->axes.n, d) > 0;
}

void camera_pixel_footprint(const struct camera *c, vec3 d, double distance, vec3 axis[2], double length[2])
{
	if (c->projection && c->projection->pixel_footprint) {
		vec3 tangent[2];
		c->projection->pixel_footprint(c, frame_to_local(&c->axes, d), tangent, length);
		for (int i = 0; i < 2; i++) {
			axis[i] = frame_to_world(&c->axes, tangent[i]);
			length[i] *= distance;
		}
		return;
	}
	axis[0] = c->axes.s;
	axis[1] = c->axes.t;
	length[0] = length[1] = distance * vec3_dot(c->axes.n, d) / c->pixels_per_slope;
}

void camera_clip_range(const struct camera *c, vec3 d, double *t_min, double *t_max)
{
	if (c->projection && c->projection->sees_all_directions) {
		*t_min = 0;
		*t_max = INFINITY;
		return;
	}
	double cosine = vec3_dot(c->axes.n, d);
	*t_min = c->near_clip / cosine;
	*t_max = c->far_clip / cosine;
}
