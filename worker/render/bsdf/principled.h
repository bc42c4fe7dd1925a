/* SPDX-License-Identifier: Apache-2.0 */
/* What `principled` and `principledthin` share: the parameters, read, and the lobes of a surface. Private to
 * worker/render/bsdf. */
#ifndef WORKER_RENDER_BSDF_PRINCIPLED_H
#define WORKER_RENDER_BSDF_PRINCIPLED_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/microfacet.h"

struct principled {
	struct texture base, roughness, metallic;
	double transmission, spec_tint, sheen, sheen_tint, flatness, clearcoat, clearcoat_alpha, aspect, eta;
	double base_max;
};

/* What a point of the surface is made of. */
struct stuff {
	const struct principled *p;
	spectrum base, tint;
	double roughness, metallic;
	struct microfacet facets;
};

struct stuff principled_stuff(const struct principled *p, const struct bsdf_point *at);
struct microfacet principled_facets(const struct principled *p, double roughness);

/* Fresnel's factor of boundary and metal, for light from above. */
spectrum principled_fresnel(const struct stuff *s, double cosine);
/* The diffuse lobe with sheen; cos_d: of either direction against the half vector. Both directions above. */
spectrum principled_diffuse(const struct stuff *s, vec3 wo, vec3 wi, double cos_d);

/* The least of a texture's values from 0 to 1, on a grid: step sizes go by that of roughness. */
double principled_least(const struct texture *t);

#endif
