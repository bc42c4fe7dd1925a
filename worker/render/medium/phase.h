/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Phase functions: how light is distributed over directions where a medium scatters it. One file per plug-in and one
 * line in phase_list.h. All depend on one angle only, between the direction in which light travels and the one in which
 * it goes on, and are the same with both exchanged: paths from the camera and from the light use them alike. Immutable
 * after creation; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MEDIUM_PHASE_H
#define WORKER_RENDER_MEDIUM_PHASE_H

#include "worker/render/math/vec3.h"
#include "worker/render/scene/scene.h"

struct phase;

struct phase_ops {
	struct plugin_decl decl;
	void (*create)(struct phase *p, const struct scene_node *n); /* NULL: nothing to read */
	/* Per solid angle; its integral over the sphere is 1. cosine: of that angle, 1 where light goes straight on. */
	double (*eval)(const struct phase *p, double cosine);
	/* A cosine with exactly this density, times 2 pi, for u in [0,1). */
	double (*sample)(const struct phase *p, double u);
};

struct phase {
	const struct phase_ops *ops;
	double g; /* mean cosine */
};

extern const struct phase_ops *const phase_registry[]; /* ends with NULL */

/* n: NULL is the isotropic one. */
void phase_create(struct phase *p, const struct scene_node *n);

/* Unit vectors that both point away from where light is scattered. pdf: per solid angle, the value of the function. */
double phase_eval(const struct phase *p, vec3 wo, vec3 wi);
vec3 phase_sample(const struct phase *p, vec3 wo, const double u[2], double *pdf);

#endif
