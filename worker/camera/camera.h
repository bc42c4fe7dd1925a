/*
 * The pinhole camera (Mitsuba's `perspective`). Film coordinates are pixels of the full film, x to the right, y down.
 * Densities: `jac_film_from_solid` is pixel area per solid angle of directions leaving the pinhole; importance is measured
 * per pixel area, so that a path tracer's sample of one film point carries plain radiance. Immutable; any thread.
 */
#ifndef WORKER_CAMERA_CAMERA_H
#define WORKER_CAMERA_CAMERA_H

#include "worker/math/frame.h"
#include "worker/scene/settings.h"

struct camera {
	vec3 position;
	struct frame axes; /* s: right on the image, t: down, n: forward */
	double width, height, scale; /* pixels; scale: pixels per unit of slope */
	double near_clip, far_clip;  /* along the axis, in the rescaled world */
};

/* -EINVAL with a sentence when the field of view is not within (0,180) degrees or the transform is singular. */
int camera_init(struct camera *c, const struct scene_settings *s, vec3 world_center, double world_scale, struct error *e);

/* The unit direction through a film point. */
vec3 camera_direction(const struct camera *c, double film_x, double film_y);
/* false: behind the camera or outside near and far. d: unit, from the camera. distance: to the point. */
bool camera_project(const struct camera *c, vec3 d, double distance, double *film_x, double *film_y);
double camera_jac_film_from_solid(const struct camera *c, vec3 d);
/* Along d, where the near and far planes are. */
void camera_clip(const struct camera *c, vec3 d, double *t_min, double *t_max);

#endif
