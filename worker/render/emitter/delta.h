/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shared by delta emitters, whose light comes from a single point. `data` of such an emitter begins with struct
 * delta_light.
 *
 * They are never seen directly, so their own brightness bounds nothing. A white diffuse surface lit by a point at 1/57
 * of the scene's radius, or a highlight of roughness 0.01, is about a thousand times as bright as the intensity at a
 * distance of one world unit: DELTA_HEADROOM times that is given as `brightest`. It sets the grid of sums of an image
 * whose bootstrap was black; if it is too small the job ends with an error, if it is too large bits below 2^-30 of it
 * are lost.
 */
#ifndef WORKER_RENDER_EMITTER_DELTA_H
#define WORKER_RENDER_EMITTER_DELTA_H

#include "worker/render/emitter/emitter.h"

#define DELTA_HEADROOM 1024.0

struct delta_light {
	struct color color; /* intensity or irradiance, in the scene's units */
	double factor;	    /* from those to the rescaled world's */
	struct emitter_point x;
};

/* `x` of em->data is set. Reads the colour `name` of the node (default 1) and sets everything of `em` except its power,
 * which is that of intensity 1 times the result of delta_strength. */
int delta_create(struct emitter *em, const struct scene_node *n, const char *name, double factor,
		 const struct emitter_build *build, struct error *e);
/* The same without the colour: the caller sets shape, brightest and power. */
int delta_place(struct emitter *em, const struct scene_node *n, double factor, struct error *e);
/* Unit axes of to_world: +z as it is, +y made perpendicular to it; a mirrored transform stays mirrored.
 * false: it is singular. */
bool delta_axes_of(const mat4 *to_world, vec3 axes[3]);
/* The same for a node; -EINVAL with a sentence. */
int delta_axes(const struct scene_node *n, const mat4 *to_world, vec3 axes[3], struct error *e);
double delta_strength(const struct delta_light *l);
/* -EINVAL with a sentence if the node gives both `name` and to_world. */
int delta_either(const struct scene_node *n, const char *name, struct error *e);
/* The origin of to_world in the rescaled world. */
vec3 delta_origin(const mat4 *to_world, const struct emitter_build *build);

bool delta_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf_point);
double delta_pdf_point(const struct emitter *em, const struct emitter_point *x);

#define DELTA_OPS .sample_point = delta_sample_point, .pdf_point = delta_pdf_point

#endif
