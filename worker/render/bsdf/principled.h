/* SPDX-License-Identifier: Apache-2.0 */
/* The parameters and the lobes shared by `principled` and `principledthin`. Private to worker/render/bsdf. */
#ifndef WORKER_RENDER_BSDF_PRINCIPLED_H
#define WORKER_RENDER_BSDF_PRINCIPLED_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/microfacet.h"

/* The parameters that are shares from 0 to 1, each a number or a texture. */
enum {
	TRANSMISSION,
	SPEC_TINT,
	SHEEN,
	SHEEN_TINT,
	FLATNESS,
	CLEARCOAT,
	CLEARCOAT_GLOSS,
	ANISOTROPIC,
	COAT,
	COAT_ROUGHNESS,
	SPECULAR_STRENGTH, /* 1 where it is not given; the others 0 */
	SHARES
};

/* The parameters at a point of the surface. */
struct principled_point {
	spectrum base, tint, specular; /* specular: the colour that SPEC_TINT mixes in */
	double roughness, metallic, eta, share[SHARES];
	struct microfacet facets, coat; /* coat: only set if share[COAT] > 0 */
	const struct principled *p;
};

struct principled {
	struct texture base, roughness, metallic, specular; /* specular: only if has_specular */
	struct texture share[SHARES];
	double most[SHARES]; /* the largest value of each share; for textures, the largest found by bsdf_probe */
	double eta, base_max;
	bool varies; /* some parameter other than base and specular varies over the surface or with the wavelength */
	bool has_specular;
	bool scaled;		       /* the boundary reflects and transmits other shares than Fresnel's */
	bool lambertian;	       /* the diffuse lobe is Lambertian */
	struct principled_point known; /* without colours; if `varies`, its numbers do not hold everywhere */
};

struct principled_point principled_at(const struct principled *p, const struct bsdf_point *at);
/* Computes p->known; to be called once all other members are set. */
void principled_know(struct principled *p, const struct bsdf_build *build);
struct microfacet principled_facets(double anisotropic, double roughness);

/* Fresnel's factor of the boundary alone, and the one of boundary and metal together, which takes the former; for light
 * from above. */
spectrum principled_boundary(const struct principled_point *s, double cosine);
spectrum principled_fresnel(const struct principled_point *s, spectrum boundary, double cosine);
/* Returns the diffuse lobe with sheen. cos_d: cosine of either direction to the half vector; boundary:
 * principled_boundary at cos_d. Both directions are above the surface. */
spectrum principled_diffuse(const struct principled_point *s, spectrum boundary, vec3 wo, vec3 wi, double cos_d);

/* Reads the shares that n has; the others are 0, or as said above. Returns 0 or a negative error code. */
int principled_shares(struct principled *p, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		      struct error *e);

#define PRINCIPLED_SHARE(name_)                                                                  \
	{                                                                                        \
		.name = name_, .types = VALUE_FLOAT | VALUE_INT | VALUE_NODE, .min = 0, .max = 1 \
	}

/* Returns the smallest value of a texture, clamped to [0,1], that bsdf_probe finds. Step sizes depend on the smallest
 * roughness. */
double principled_least(const struct texture *t, const struct bsdf_build *build);

#endif
