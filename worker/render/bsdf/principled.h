/* SPDX-License-Identifier: Apache-2.0 */
/* The parameters and the lobes shared by `principled` and `principledthin`. Private to worker/render/bsdf. */
#ifndef WORKER_RENDER_BSDF_PRINCIPLED_H
#define WORKER_RENDER_BSDF_PRINCIPLED_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/microfacet.h"

/* The parameters that are shares from 0 to 1, each a number or a texture. */
enum {
	PRINCIPLED_TRANSMISSION,
	PRINCIPLED_SPEC_TINT,
	PRINCIPLED_SHEEN,
	PRINCIPLED_SHEEN_TINT,
	PRINCIPLED_FLATNESS,
	PRINCIPLED_CLEARCOAT,
	PRINCIPLED_CLEARCOAT_GLOSS,
	PRINCIPLED_ANISOTROPIC,
	PRINCIPLED_COAT,
	PRINCIPLED_COAT_ROUGHNESS,
	PRINCIPLED_SPECULAR_STRENGTH, /* 1 where it is not given; the others 0 */
	PRINCIPLED_SHARE_COUNT
};

/* The parameters at a point of the surface. */
struct principled_point {
	spectrum base, tint, specular; /* specular: the colour that PRINCIPLED_SPEC_TINT mixes in */
	double roughness, metallic, eta, share[PRINCIPLED_SHARE_COUNT];
	struct microfacet facets, coat; /* coat: only set if share[PRINCIPLED_COAT] > 0 */
	const struct principled *principled;
};

struct principled {
	struct texture base, roughness, metallic, specular; /* specular: only if has_specular */
	struct texture share[PRINCIPLED_SHARE_COUNT];
	double max_share[PRINCIPLED_SHARE_COUNT]; /* the largest value of each share; for textures, the largest found by
						     bsdf_probe_point */
	double eta, max_base;
	bool is_textured; /* some parameter other than base and specular varies over the surface or with the wavelength
			   */
	bool has_specular;
	bool scales_boundary;		     /* the boundary reflects and transmits other shares than Fresnel's */
	bool is_lambertian;		     /* the diffuse lobe is Lambertian */
	struct principled_point precomputed; /* without colours; if `is_textured`, its numbers do not hold everywhere */
};

struct principled_point principled_point_at(const struct principled *p, const struct bsdf_point *point);
/* Computes p->precomputed; to be called once all other members are set. */
void principled_precompute(struct principled *p, const struct bsdf_build *build);
struct microfacet principled_facets(double anisotropic, double roughness);

/* Fresnel's factor of the boundary alone, and the one of boundary and metal together, which takes the former; for light
 * from above. */
spectrum principled_boundary_fresnel(const struct principled_point *s, double cosine);
spectrum principled_fresnel(const struct principled_point *s, spectrum boundary, double cosine);
/* Returns the diffuse lobe with sheen. cos_d: cosine of either direction to the half vector; boundary:
 * principled_boundary_fresnel at cos_d. Both directions are above the surface. */
spectrum principled_eval_diffuse(const struct principled_point *s, spectrum boundary, vec3 wo, vec3 wi, double cos_d);

/* Reads the shares that n has; the others are 0, or as said above. Returns 0 or a negative error code. */
int principled_read_shares(struct principled *p, struct bsdf *b, const struct scene_node *n,
			   const struct bsdf_build *build, struct error *e);

#define PRINCIPLED_SHARE(name_)                                                                  \
	{                                                                                        \
		.name = name_, .types = VALUE_FLOAT | VALUE_INT | VALUE_NODE, .min = 0, .max = 1 \
	}

/* Returns the smallest value of a texture, clamped to [0,1], that bsdf_probe_point finds. Step sizes depend on the
 * smallest roughness. */
double principled_min_value(const struct texture *t, const struct bsdf_build *build);

#endif
