/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What delta emitters share: one point that is always drawn. `data` of such an emitter begins with struct delta_light.
 *
 * Nobody sees them, so their own brightness bounds nothing. A white diffuse surface in the light of a point at 1/57 of
 * the scene's radius, or a highlight of roughness 0.01, is about a thousand times as bright as the intensity at the
 * distance of one world unit: DELTA_HEADROOM times that is given as `brightest`. It sets the grid of sums of a picture
 * whose bootstrap was black; what it is too small for ends the job with an error, what it is too large for loses bits
 * below 2^-30 of it.
 */
#ifndef WORKER_RENDER_EMITTER_DELTA_H
#define WORKER_RENDER_EMITTER_DELTA_H

#include "worker/render/emitter/emitter.h"
#include "worker/render/math/mat4.h"

#define DELTA_HEADROOM 1024.0

struct delta_light {
	struct color color; /* intensity or irradiance, in the scene's units */
	double factor;	    /* from those to the rescaled world's */
	struct emitter_point x;
};

/* The colour `name` of the node (default 1) and everything of `em` but its power, which is that of intensity 1 times
 * what delta_strength gives. */
int delta_create(struct emitter *em, struct delta_light *l, const struct scene_node *n, const char *name, double factor,
		 const struct emitter_build *build, struct error *e);
/* The same without the colour: shape, brightest and power are the caller's. */
int delta_place(struct emitter *em, struct delta_light *l, const struct scene_node *n, double factor, struct error *e);
/* Unit axes of to_world: +z as it is, +y made perpendicular to it, a mirrored transform stays mirrored. -EINVAL with a
 * sentence when it is singular. */
int delta_axes(const struct scene_node *n, const mat4 *to_world, vec3 axes[3], struct error *e);
double delta_strength(const struct delta_light *l);
/* -EINVAL with a sentence when the node gives both. */
int delta_either(const struct scene_node *n, const char *name, const char *other, struct error *e);

bool delta_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf_point);
double delta_pdf_point(const struct emitter *em, const struct emitter_point *x);
bool delta_sample_toward(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x,
			 double *pdf_toward);
double delta_pdf_toward(const struct emitter *em, vec3 ref, const struct emitter_point *x);

#endif
