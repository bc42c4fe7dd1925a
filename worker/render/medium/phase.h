/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Phase functions: how light is distributed over directions where a medium scatters it. One file per plug-in and one
 * line in phase_list.h. Most depend on one angle only, between the direction in which light travels and the one in
 * which it goes on, and are the same with both exchanged. Those of microflakes depend on both directions, and so does
 * the medium's extinction, which is proportional to the area of the flakes as seen along the ray: that area times the
 * phase function is the same with both exchanged, so that paths from the camera and from the light use them alike. They
 * may differ from place to place. Immutable after creation; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MEDIUM_PHASE_H
#define WORKER_RENDER_MEDIUM_PHASE_H

#include "worker/render/volume/volume.h"

struct phase;

struct phase_ops {
	struct plugin_decl decl;
	/* NULL: nothing to read */
	int (*create)(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e);
	/* Per solid angle, at a place; its integral over the sphere is 1. cosine: of that angle, 1 where light goes
	 * straight on. */
	double (*eval)(const struct phase *p, vec3 at, double cosine);
	/* A cosine with exactly this density, times 2 pi, for u in [0,1). */
	double (*sample)(const struct phase *p, vec3 at, double u);
	/* Of microflakes, instead of these two, and NULL otherwise. The density of wi, per solid angle, where light
	 * comes from or goes to wo; a direction with this density; and the area seen along w, the same along -w. */
	double (*eval_flakes)(const struct phase *p, vec3 at, vec3 wo, vec3 wi);
	vec3 (*sample_flakes)(const struct phase *p, vec3 at, vec3 wo, const double u[2]);
	double (*area)(const struct phase *p, vec3 at, vec3 w);
};

struct phase {
	const struct phase_ops *ops;
	double g;		     /* hg's mean cosine */
	double absorbed;	     /* share of what the medium scatters that is absorbed instead; not in eval */
	const void *data;	     /* of some plug-ins */
	const struct flakes *flakes; /* of microflakes (flakes.h); NULL */
};

extern const struct phase_ops *const phase_registry[]; /* ends with NULL */

/* n: NULL is the isotropic one. */
int phase_create(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e);

/* Unit vectors that both point away from `at`, where light is scattered. pdf: of wi, per solid angle, the value of the
 * function. */
double phase_eval(const struct phase *p, vec3 at, vec3 wo, vec3 wi);
vec3 phase_sample(const struct phase *p, vec3 at, vec3 wo, const double u[2], double *pdf);

/* What the extinction along w is multiplied by. */
static inline double phase_area(const struct phase *p, vec3 at, vec3 w)
{
	return p->ops->area ? p->ops->area(p, at, w) : 1;
}

#endif
