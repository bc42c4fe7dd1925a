/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Microfacet distributions, Beckmann and GGX (Walter et al. 2007, Microfacet Models for Refraction), with Smith's
 * masking; the roughness along u and v may differ (Heitz 2014, section 5.3: the isotropic distribution, stretched).
 * Shadowing and masking are independent, G2 = G1 G1, as in Mitsuba. G1 is always divided by the cosine, so everything
 * stays finite at grazing angles. Roughness is at least MICROFACET_ALPHA_MIN.
 */
#ifndef WORKER_RENDER_BSDF_MICROFACET_H
#define WORKER_RENDER_BSDF_MICROFACET_H

#include "worker/render/math/minmax.h"
#include "worker/render/math/vec3.h"
#include "worker/render/scene/scene.h"

#include <stdbool.h>

#define MICROFACET_ALPHA_MIN 1e-6
#define MICROFACET_RATIO_MAX 1e4

struct microfacet {
	bool is_ggx;
	double alpha; /* roughness along u */
	double ratio; /* roughness along v over that along u */
};

/* Sets m, raising roughness to at least MICROFACET_ALPHA_MIN. */
void microfacet_init(struct microfacet *m, bool is_ggx, double alpha_u, double alpha_v);
double microfacet_min_alpha(const struct microfacet *m);  /* the smaller of the two roughnesses */
double microfacet_mean_alpha(const struct microfacet *m); /* their geometric mean */

/* Returns the density of microfacet normals (1/sr): the integral of D(h) h.z over the hemisphere is 1. h: a unit
 * vector. */
double microfacet_d(const struct microfacet *m, vec3 h);

/* Returns Smith's G1(v) / v.z for a unit vector v with v.z > 0. */
double microfacet_g1_over_cos(const struct microfacet *m, vec3 v);

/* Samples a normal visible from v (v.z > 0), with density G1(v) max(0, v.h) D(h) / v.z. GGX: Dupuy and Benyoub 2023;
 * Beckmann: Heitz and d'Eon 2014, inverted to double precision. */
vec3 microfacet_sample_visible(const struct microfacet *m, vec3 v, double u0, double u1);

/* Computes the direction and the length of the half vector wo + eta wi. Returns false if it is too short to have a
 * direction. */
static inline bool microfacet_half_vector(vec3 wo, double eta, vec3 wi, vec3 *h, double *length)
{
	vec3 sum = vec3_madd(wo, eta, wi);
	double largest = max_of(fabs(sum.x), max_of(fabs(sum.y), fabs(sum.z)));
	if (!(largest > 1e-300))
		return false;
	sum = vec3_scale(1 / largest, sum);
	double l = vec3_length(sum);
	*h = vec3_scale(1 / l, sum);
	*length = l * largest;
	return true;
}

/* Returns the direction to which a facet with normal h reflects light from w. */
static inline vec3 microfacet_mirror(vec3 w, vec3 h)
{
	return vec3_normalize(vec3_sub(vec3_scale(2 * vec3_dot(w, h), h), w));
}

/* Samples a direction to which a facet visible from w reflects its light. */
static inline vec3 microfacet_sample_mirrored(const struct microfacet *m, vec3 w, double u0, double u1)
{
	return microfacet_mirror(w, microfacet_sample_visible(m, w, u0, u1));
}

/* Returns f of the light that a rough dielectric boundary of index eta reflects, for wo and wi above it. *pdf: the
 * density of wi (solid angle) if visible normals are sampled, D G1(wo) / 4 wo.z. */
double microfacet_reflect(const struct microfacet *m, double eta, vec3 wo, vec3 wi, double *pdf);

/* Reads the parameters alpha, alpha_u, alpha_v and distribution. -ERANGE if the roughnesses differ by more than
 * MICROFACET_RATIO_MAX. */
int microfacet_read(struct microfacet *m, const struct scene_node *n, struct error *e);

/* Parameters of smooth materials that have no effect: editors leave them when a rough material is made smooth. */
#define MICROFACET_PARAMS_IGNORED                                                                                \
	{.name = "alpha", .status = PARAM_IGNORED}, {.name = "alpha_u", .status = PARAM_IGNORED},                \
		{.name = "alpha_v", .status = PARAM_IGNORED}, {.name = "distribution", .status = PARAM_IGNORED}, \
	{                                                                                                        \
		.name = "sample_visible", .status = PARAM_IGNORED                                                \
	}

#endif
