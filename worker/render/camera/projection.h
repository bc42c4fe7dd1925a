/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Projections of pinhole cameras other than onto a plane: one-to-one maps between directions in the camera's frame
 * (right, down, forward) and film points. Private to worker/render/camera. Pure; any thread.
 */
#ifndef WORKER_RENDER_CAMERA_PROJECTION_H
#define WORKER_RENDER_CAMERA_PROJECTION_H

#include "worker/render/scene/settings.h"

struct camera;

struct camera_projection {
	bool sees_all_directions; /* the camera sees all directions, and has no clipping planes */
	/* Reads parameters into c. Returns 0, or -EINVAL with a sentence. NULL: no parameters. */
	int (*init)(struct camera *c, const struct scene_settings *s, struct error *e);
	/* Computes the direction that a film point sees, not normalised. Returns false if it sees none. */
	bool (*direction)(const struct camera *c, double film_x, double film_y, vec3 *l);
	/* Computes the film point that sees a unit direction. Returns false if there is none. */
	bool (*project)(const struct camera *c, vec3 l, double *film_x, double *film_y);
	/* Returns the pixel area per solid angle at a unit direction. */
	double (*jac_film_from_solid)(const struct camera *c, vec3 l);
	/* Computes the unit tangents along which l moves with film_x and film_y, and the rates per pixel. NULL: as on a
	 * plane. */
	void (*pixel_footprint)(const struct camera *c, vec3 l, vec3 tangent[2], double rate[2]);
};

/* Returns NULL for the projection onto a plane. */
const struct camera_projection *camera_projection_find(enum scene_projection p);

#endif
