/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The camera: a pinhole (Mitsuba's `perspective`; far away, `orthographic`) or an ideal thin lens (`thinlens`; far
 * away, `telecentric`). Pinholes may have another projection than that of a plane (projection.h): `spherical`,
 * `perspective_rdist`. Film
 * coordinates are pixels of the full film, x to the right, y down.
 *
 * A path's camera end x_k is the pinhole, or a point of the aperture, a disk around the camera's position across its
 * axis (Kolb, Mitchell, Hanrahan 1995, sec. 3). A film point and x_k give the ray: from x_k to where the pinhole's ray
 * through the film point meets the plane of focus, `focus` along the axis. A plane across the axis is thus imaged
 * sharp, and the slope of the ray is that of the pinhole's less the offset of x_k over `focus`: pixels per solid angle
 * do not depend on x_k.
 *
 * Measures: area on the aperture counts in units of the aperture's area, so that x_k, uniform, has density 1;
 * `jac_film_from_solid` is pixel area per solid angle of directions leaving x_k; importance is measured per pixel area,
 * so that a path tracer's sample of one film point carries plain radiance. Lengths: the rescaled world. Immutable; any
 * thread; allocates nothing.
 */
#ifndef WORKER_RENDER_CAMERA_CAMERA_H
#define WORKER_RENDER_CAMERA_CAMERA_H

#include "worker/render/math/frame.h"
#include "worker/render/math/motion.h"
#include "worker/render/scene/settings.h"

struct camera_projection;

struct camera {
	vec3 position;		     /* the pinhole, or the centre of the aperture */
	struct frame axes;	     /* s: right on the image, t: down, n: forward */
	double width, height, scale; /* pixels; scale: pixels per unit of slope */
	double center_x,
		center_y; /* the film point on the axis: the film's middle but for the principal point's offset */
	double near_clip, far_clip; /* along the axis, in the rescaled world */
	bool lens;		    /* x_k is drawn and mutated: the radius is above 0, or this was forced */
	double aperture, focus;	    /* radius; distance of the plane of focus along the axis */
	const struct camera_projection *projection; /* NULL: that of a plane */
	double kc[2], fold;	    /* of perspective_rdist; the squared slope at which its image ends */
	const struct motion *moves; /* to the rescaled world; NULL: it is still. Otherwise position and axes are those
				       when the shutter opens */
};

/* -EINVAL with a sentence if the field of view is not within (0,180) degrees, the transform is singular, or a lens
 * is focused behind it. */
int camera_init(struct camera *c, const struct scene_settings *s, vec3 world_center, double world_scale,
		struct error *e);

void camera_move(const struct camera *c, double time, struct camera *out);
/* The camera at that time; room: for one that moves. */
static inline const struct camera *camera_at(const struct camera *c, double time, struct camera *room)
{
	if (!c->moves)
		return c;
	camera_move(c, time, room);
	return room;
}

bool camera_has_aperture(const struct camera *c);
/* Forces drawing and mutating x_k even if the radius is 0; or makes any camera a pinhole. */
void camera_force_aperture(struct camera *c, bool on);
/* x_k from two numbers in [0,1), uniform on the aperture (Shirley and Chiu 1997); without one, the pinhole's
 * position. */
vec3 camera_point(const struct camera *c, const double u[2]);
/* The numbers in [0,1) that give p, a point of the aperture; 1/2, 1/2 without one. */
void camera_point_inverse(const struct camera *c, vec3 p, double u[2]);

/* Whether a film point looks anywhere: points beyond the edge of a panorama do not. */
bool camera_has(const struct camera *c, double film_x, double film_y);
/* The unit direction in which light from a film point, which it has, leaves x_k. */
vec3 camera_direction(const struct camera *c, vec3 x_k, double film_x, double film_y);
/* The film point that sees, through x_k, along the unit direction d. false: behind the camera or outside near and far.
 * distance: from x_k to the point seen. */
bool camera_project(const struct camera *c, vec3 x_k, vec3 d, double distance, double *film_x, double *film_y);
/* The same for all x_k. */
double camera_jac_film_from_solid(const struct camera *c, vec3 d);
/* Whether it sees anything along d. */
bool camera_looks(const struct camera *c, vec3 d);
/* How what is seen along the unit direction d, at that distance from x_k, moves across d with film_x and film_y: unit
 * axes, but for what is along d, and lengths a pixel. As if perspective_rdist did not distort. */
void camera_pixel(const struct camera *c, vec3 d, double distance, vec3 axis[2], double length[2]);
/* Along d from x_k, in units of d, where the near and far planes are. It looks along d. */
void camera_clip(const struct camera *c, vec3 d, double *t_min, double *t_max);

#endif
