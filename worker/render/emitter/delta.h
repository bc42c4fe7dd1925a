/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Functions shared by delta emitters, whose light comes from a single point. `data` of such an emitter begins with
 * struct delta_light.
 *
 * They are never seen directly, so their own brightness is no bound for that of pixels. A white diffuse surface lit by
 * a point light at 1/57 of the scene's radius, or a highlight of roughness 0.01, is about a thousand times as bright as
 * the intensity at a distance of one world unit. `brightness_bound` is therefore DELTA_HEADROOM times the latter. It
 * determines the grid for the sums of an image whose bootstrap was black: if it is too small, the job fails; if it is
 * too large, bits below 2^-30 times its value are lost.
 */
#ifndef WORKER_RENDER_EMITTER_DELTA_H
#define WORKER_RENDER_EMITTER_DELTA_H

#include "worker/render/emitter/emitter.h"

#define DELTA_HEADROOM 1024.0

struct delta_light {
	struct color color;	    /* intensity or irradiance, in the scene's units */
	double factor;		    /* factor that converts `color` to the units of the rescaled world */
	struct emitter_point point; /* the point, or the direction at infinity */
};

/* Reads the colour `name` of the node (1 by default) and sets all members of `em` except its power, which is the power
 * for intensity 1 times delta_strength(). The caller has set `point` of em->data. Returns 0 or a negative error code.
 */
int delta_create(struct emitter *em, const struct scene_node *n, const char *name, double factor,
		 const struct emitter_build *build, struct error *e);
/* Like delta_create(), but without the colour: the caller sets color_kind, brightness_bound and power. */
int delta_init(struct emitter *em, const struct scene_node *n, double factor, struct error *e);
/* Computes unit axes of to_world: +z is kept, +y is made perpendicular to it, and a mirrored transform stays mirrored.
 * Returns false if to_world is singular. */
bool delta_axes_from_transform(const mat4 *to_world, vec3 axes[3]);
/* Like delta_axes_from_transform(), but returns 0, or -EINVAL with a sentence that names the node. */
int delta_read_axes(const struct scene_node *n, const mat4 *to_world, vec3 axes[3], struct error *e);
/* Returns the factor times the mean of the colour over wavelengths. */
double delta_strength(const struct delta_light *l);
/* Returns -EINVAL with a sentence if the node has both `name` and to_world, otherwise 0. */
int delta_check_exclusive(const struct scene_node *n, const char *name, struct error *e);
/* Returns the origin of to_world in the rescaled world. */
vec3 delta_origin(const mat4 *to_world, const struct emitter_build *build);

bool delta_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf_point);
double delta_pdf_point(const struct emitter *em, const struct emitter_point *x);

#define DELTA_OPS .sample_point = delta_sample_point, .pdf_point = delta_pdf_point

#endif
