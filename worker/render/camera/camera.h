/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The camera: a pinhole (Mitsuba's `perspective` and, from far away, `orthographic`) or an ideal thin lens (`thinlens`
 * and, from far away, `telecentric`). A pinhole may project differently than onto a plane (projection.h): `spherical`,
 * `perspective_rdist`. Film coordinates are pixels of the full film, x to the right, y down.
 *
 * A path's camera end x_k is the pinhole, or a point of the aperture, which is a disk around the camera's position
 * perpendicular to its axis (Kolb, Mitchell, Hanrahan 1995, sec. 3). A film point and x_k define a ray: from x_k to the
 * point where the pinhole's ray through the film point meets the plane of focus, at the distance `focus_distance` along
 * the axis. That plane is thus imaged sharply, and the slope of the ray is that of the pinhole's ray minus the offset
 * of x_k over `focus_distance`. The pixels per solid angle do not depend on x_k.
 *
 * Measures: area on the aperture counts in units of the aperture's area, so that a uniform x_k has density 1;
 * `jac_film_from_solid` is pixel area per solid angle of directions leaving x_k; importance is measured per pixel area,
 * so that a path tracer's sample of one film point carries plain radiance. Lengths are those of the rescaled world.
 * Immutable; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_CAMERA_CAMERA_H
#define WORKER_RENDER_CAMERA_CAMERA_H

#include "worker/render/math/frame.h"
#include "worker/render/math/motion.h"
#include "worker/render/scene/settings.h"

struct camera_projection;

struct camera {
	vec3 position;				/* the pinhole, or the centre of the aperture */
	struct frame axes;			/* s: right on the image, t: down, n: forward */
	double width, height, pixels_per_slope; /* width, height: of the film, in pixels */
	double center_x, center_y;  /* the film point on the axis: the middle of the film plus the offset of the
				       principal point */
	double near_clip, far_clip; /* distances along the axis, in the rescaled world */
	bool has_lens; /* x_k is sampled and mutated: the radius is above 0, or camera_force_aperture was used */
	double aperture_radius, focus_distance;	    /* focus_distance: of the plane of focus, along the axis */
	const struct camera_projection *projection; /* NULL: onto a plane */
	double kc[2], fold_slope_squared; /* for perspective_rdist; fold_slope_squared: of the slope at which the image
					     ends */
	const struct motion *motion; /* motion of the camera, to the rescaled world; NULL: none. With one, position and
				       axes are those at the opening of the shutter */
};

/* Initialises c from the settings, in the world rescaled about world_center by world_scale. Returns 0, or with a
 * sentence in e: -EINVAL if the field of view is not within (0,180) degrees, the transform is singular, or a lens is
 * focused behind itself; -ERANGE if the camera is too far from the scene. */
int camera_init(struct camera *c, const struct scene_settings *s, vec3 world_center, double world_scale,
		struct error *e);

/* Sets *out to the camera c, which has a motion, at the given time. */
void camera_move(const struct camera *c, double time, struct camera *out);
/* Returns the camera at the given time: c itself if it does not move, otherwise *storage. */
static inline const struct camera *camera_at(const struct camera *c, double time, struct camera *storage)
{
	if (!c->motion)
		return c;
	camera_move(c, time, storage);
	return storage;
}

bool camera_has_aperture(const struct camera *c);
/* With on, x_k is sampled and mutated even if the aperture's radius is 0; without, the camera becomes a pinhole. */
void camera_force_aperture(struct camera *c, bool on);
/* Maps two numbers in [0,1) to a point x_k, uniform on the aperture (Shirley and Chiu 1997); without an aperture,
 * returns the position of the pinhole. */
vec3 camera_sample_point(const struct camera *c, const double u[2]);
/* Computes the numbers in [0,1) that camera_sample_point maps to the point p of the aperture; 1/2, 1/2 without an
 * aperture. */
void camera_point_inverse(const struct camera *c, vec3 p, double u[2]);

/* Returns whether the film point sees any direction: points beyond the edge of a panorama do not. */
bool camera_film_point_is_valid(const struct camera *c, double film_x, double film_y);
/* Returns the unit direction from x_k that the film point sees; camera_film_point_is_valid is true for it. */
vec3 camera_direction(const struct camera *c, vec3 x_k, double film_x, double film_y);
/* Finds the film point that sees, through x_k, along the unit direction d. distance: from x_k to the point seen.
 * Returns false if that point is behind the camera or beyond the clipping planes. */
bool camera_project(const struct camera *c, vec3 x_k, vec3 d, double distance, double *film_x, double *film_y);
/* Returns the pixel area per solid angle at the unit direction d, which is the same for all x_k. */
double camera_jac_film_from_solid(const struct camera *c, vec3 d);
/* Returns whether the camera sees anything along d. */
bool camera_sees_direction(const struct camera *c, vec3 d);
/* Computes how the point seen along the unit direction d, at the given distance from x_k, moves across d as film_x and
 * film_y change: two unit axes, whose components along d are to be ignored, and lengths per pixel. The distortion of
 * perspective_rdist is ignored. */
void camera_pixel_footprint(const struct camera *c, vec3 d, double distance, vec3 axis[2], double length[2]);
/* Computes the distances along d, in units of d, from x_k to the near and far planes. camera_sees_direction is true for
 * d. */
void camera_clip_range(const struct camera *c, vec3 d, double *t_min, double *t_max);

#endif
