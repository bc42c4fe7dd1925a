/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Cameras that do not throw a plane onto the film: how directions in the camera's frame (right, down, forward) and film
 * points belong together, one to one. A pinhole each. Private to worker/render/camera. Pure; any thread.
 */
#ifndef WORKER_RENDER_CAMERA_PROJECTION_H
#define WORKER_RENDER_CAMERA_PROJECTION_H

#include "worker/render/scene/settings.h"

struct camera;

struct camera_projection {
	bool all_around; /* it looks backwards, too, and has no clipping planes */
	/* -EINVAL with a sentence; NULL: nothing is to be done. */
	int (*init)(struct camera *c, const struct scene_settings *s, struct error *e);
	/* The direction in which a film point looks, not normalised; false: the projection has no such point. */
	bool (*direction)(const struct camera *c, double film_x, double film_y, vec3 *l);
	/* The film point of a unit direction; false: it has none. */
	bool (*project)(const struct camera *c, vec3 l, double *film_x, double *film_y);
	double (*jac_film_from_solid)(const struct camera *c, vec3 l);
	/* Unit tangents along which l moves with film_x and film_y, and by how much a pixel; NULL: as on a plane. */
	void (*pixel)(const struct camera *c, vec3 l, vec3 tangent[2], double rate[2]);
};

/* NULL: onto a plane, without one. */
const struct camera_projection *camera_projection_of(enum scene_projection p);

#endif
