/* SPDX-License-Identifier: Apache-2.0 */
/* Shared by `principled` and `principledthin`: the parameters and the lobes of a surface. Private to
 * worker/render/bsdf. */
#ifndef WORKER_RENDER_BSDF_PRINCIPLED_H
#define WORKER_RENDER_BSDF_PRINCIPLED_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/microfacet.h"

/* The parameters that are shares, from 0 to 1: numbers or textures. */
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
	SHARES
};

/* The parameters at a point of the surface. */
struct principled_point {
	spectrum base, tint, specular; /* specular: what SPEC_TINT mixes in */
	double roughness, metallic, eta, share[SHARES];
	struct microfacet facets, coat; /* coat: only where there is one */
	const struct principled *p;
};

struct principled {
	struct texture base, roughness, metallic, specular; /* specular: if has_specular */
	struct texture share[SHARES];
	double most[SHARES]; /* the largest value of each, for textures as found by bsdf_probe */
	double eta, base_max;
	bool varies; /* some parameter but base and specular does, over the surface or with the wavelength */
	bool has_specular;
	bool lambertian;	       /* the diffuse lobe */
	struct principled_point known; /* without colours; all of it unless `varies` */
};

struct principled_point principled_at(const struct principled *p, const struct bsdf_point *at);
/* Makes `known`, once everything else is. */
void principled_know(struct principled *p, const struct bsdf_build *build);
struct microfacet principled_facets(double anisotropic, double roughness);

/* Fresnel's factor of the boundary alone, and with it that of boundary and metal, for light from above. */
spectrum principled_boundary(const struct principled_point *s, double cosine);
spectrum principled_fresnel(const struct principled_point *s, spectrum boundary, double cosine);
/* The diffuse lobe with sheen; cos_d: cosine of either direction to the half vector, at which the boundary reflects
 * that much. Both directions are above. */
spectrum principled_diffuse(const struct principled_point *s, spectrum boundary, vec3 wo, vec3 wi, double cos_d);

/* Reads those of the parameters that the plug-in has; the others are 0. */
int principled_shares(struct principled *p, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		      struct error *e);

#define PRINCIPLED_SHARE(name_)                                                                  \
	{                                                                                        \
		.name = name_, .types = VALUE_FLOAT | VALUE_INT | VALUE_NODE, .min = 0, .max = 1 \
	}

/* The smallest value of a texture, from 0 to 1, that bsdf_probe finds: step sizes depend on that of roughness. */
double principled_least(const struct texture *t, const struct bsdf_build *build);

#endif
