/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Phase functions: the distribution of scattered light over directions. One file per plug-in and one line in
 * phase_list.h. Most depend only on the angle between the direction of light before and after scattering, and are
 * symmetric in these. Those of microflakes depend on both directions; there the medium's extinction is proportional to
 * the area of the flakes seen along the ray, and that area times the phase function is symmetric, so that paths from
 * the camera and from a light use the same functions. Phase functions may vary in space. Immutable after creation; any
 * thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MEDIUM_PHASE_H
#define WORKER_RENDER_MEDIUM_PHASE_H

#include "worker/render/volume/volume.h"

struct phase;

struct phase_ops {
	struct plugin_decl decl;
	/* NULL: the plug-in has no parameters */
	int (*create)(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e);
	/* Returns the value (1/sr) at the point `position`; its integral over the sphere is 1. cosine: of the angle
	 * between the directions before and after scattering, 1 if light goes straight on. */
	double (*eval)(const struct phase *p, vec3 position, double cosine);
	/* Samples a cosine for u in [0,1); its density is exactly 2 pi times that value. */
	double (*sample)(const struct phase *p, vec3 position, double u);
	/* For microflakes instead of eval and sample, otherwise NULL. eval_flakes returns the density (1/sr) of wi for
	 * light that comes from or goes to wo, sample_flakes samples a direction with this density, and area returns
	 * the area of the flakes seen along w, which is the same along -w. */
	double (*eval_flakes)(const struct phase *p, vec3 position, vec3 wo, vec3 wi);
	vec3 (*sample_flakes)(const struct phase *p, vec3 position, vec3 wo, const double u[2]);
	double (*area)(const struct phase *p, vec3 position, vec3 w);
};

struct phase {
	const struct phase_ops *ops;
	double g;		     /* mean cosine of hg */
	double absorbed_share;	     /* share of scattered light that is absorbed instead; eval does not include it */
	const void *data;	     /* of the plug-in */
	const struct flakes *flakes; /* microflakes (flakes.h); otherwise NULL */
};

extern const struct phase_ops *const phase_registry[]; /* ends with NULL */

/* Creates the phase function of node n, or the isotropic one if n is NULL. Returns 0 or a negative error code. */
int phase_create(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e);

/* Evaluate and sample the phase function at the point `position`. wo and wi are unit vectors that both point away from
 * it. *pdf: density of wi (solid angle), which is the value of the function. */
double phase_eval(const struct phase *p, vec3 position, vec3 wo, vec3 wi);
vec3 phase_sample(const struct phase *p, vec3 position, vec3 wo, const double u[2], double *pdf);

/* Returns the factor of the extinction along w. */
static inline double phase_area(const struct phase *p, vec3 position, vec3 w)
{
	return p->ops->area ? p->ops->area(p, position, w) : 1;
}

#endif
