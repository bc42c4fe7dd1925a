#include "worker/camera/camera.h"

#include <string.h>

/* Pixels per unit of slope: the same for both axes, so `smaller` and the like only choose which side the angle spans. */
static double pixels_per_slope(const struct scene_settings *s)
{
	double w = s->width, h = s->height, side = w;
	if (strcmp(s->fov_axis, "y") == 0)
		side = h;
	else if (strcmp(s->fov_axis, "diagonal") == 0)
		side = hypot(w, h);
	else if (strcmp(s->fov_axis, "smaller") == 0)
		side = fmin(w, h);
	else if (strcmp(s->fov_axis, "larger") == 0)
		side = fmax(w, h);
	return side / (2 * tan(s->fov * (M_PI / 360)));
}

int camera_init(struct camera *c, const struct scene_settings *s, vec3 world_center, double world_scale, struct error *e)
{
	if (!(s->fov > 0 && s->fov < 180))
		return error_set(e, EINVAL, "the sensor's field of view of %g degrees is not between 0 and 180", s->fov);
	vec3 forward = mat4_vector(&s->to_world, (vec3){0, 0, 1});
	vec3 up = mat4_vector(&s->to_world, (vec3){0, 1, 0});
	vec3 left = mat4_vector(&s->to_world, (vec3){1, 0, 0});
	double volume = fabs(vec3_dot(left, vec3_cross(up, forward)));
	if (!(volume > 0) || !isfinite(volume))
		return error_set(e, EINVAL, "the sensor's to_world transform is singular");
	/* A mirrored transform gives a mirrored image, as in Mitsuba: the axes are taken as they come. */
	c->axes.n = vec3_normalize(forward);
	c->axes.s = vec3_neg(vec3_normalize(left));
	c->axes.t = vec3_neg(vec3_normalize(up));
	c->position = vec3_scale(world_scale, vec3_sub(mat4_point(&s->to_world, (vec3){0, 0, 0}), world_center));
	c->width = s->width;
	c->height = s->height;
	c->scale = pixels_per_slope(s);
	c->near_clip = s->near_clip * world_scale;
	c->far_clip = s->far_clip * world_scale;
	return 0;
}

vec3 camera_direction(const struct camera *c, double film_x, double film_y)
{
	vec3 l = {(film_x - c->width / 2) / c->scale, (film_y - c->height / 2) / c->scale, 1};
	return vec3_normalize(frame_to_world(&c->axes, l));
}

bool camera_project(const struct camera *c, vec3 d, double distance, double *film_x, double *film_y)
{
	vec3 l = frame_to_local(&c->axes, d);
	double depth = l.z * distance;
	if (!(l.z > 0) || depth < c->near_clip || depth > c->far_clip)
		return false;
	*film_x = c->width / 2 + c->scale * (l.x / l.z);
	*film_y = c->height / 2 + c->scale * (l.y / l.z);
	return isfinite(*film_x) && isfinite(*film_y);
}

double camera_jac_film_from_solid(const struct camera *c, vec3 d)
{
	double cosine = vec3_dot(c->axes.n, d);
	return c->scale * c->scale / (cosine * cosine * cosine);
}

void camera_clip(const struct camera *c, vec3 d, double *t_min, double *t_max)
{
	double cosine = vec3_dot(c->axes.n, d);
	*t_min = c->near_clip / cosine;
	*t_max = c->far_clip / cosine;
}
