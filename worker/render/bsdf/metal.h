/* SPDX-License-Identifier: Apache-2.0 */
/* The complex index of a conductor, relative to the outside, shared by `conductor` and `roughconductor`. */
#ifndef WORKER_RENDER_BSDF_METAL_H
#define WORKER_RENDER_BSDF_METAL_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/ior.h"

struct metal {
	struct texture eta, k;
	bool is_textured; /* eta or k is textured; a textured one is not yet divided by the index outside */
	double eta_divisor, k_divisor; /* the index outside for a textured one, otherwise 1 */
	struct texture reflectance;    /* factor of the Fresnel term */
	bool is_perfect_mirror;	       /* reflects all light: the Fresnel factor is 1 */
};

/* Reads material, eta, k, ext_eta and specular_reflectance. The default material is Cu in the 0.5/0.6 dialect and none
 * (a perfect mirror) in 3.x; eta and k override it. Sets b's colour and texture flags. Returns 0 or a negative error
 * code. */
int metal_read(struct metal *m, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
	       struct error *e);
#define METAL_PARAMS                                                                                                  \
	{.name = "material", .types = VALUE_STRING}, {.name = "eta", .types = VALUE_TEXTURE, .max = PARAM_METAL_MAX}, \
		{.name = "k", .types = VALUE_TEXTURE, .max = PARAM_METAL_MAX}, IOR_NUMBER("ext_eta"),                 \
	{                                                                                                             \
		.name = "specular_reflectance", .types = VALUE_TEXTURE, .max = 1                                      \
	}

/* Returns the reflectance for the cosine of the direction to the normal of the surface or microfacet. */
spectrum metal_fresnel(const struct metal *m, const struct bsdf_point *p, double cosine);

#endif
