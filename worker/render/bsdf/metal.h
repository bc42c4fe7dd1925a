/* SPDX-License-Identifier: Apache-2.0 */
/* The complex index of a conductor, relative to the outside: shared by conductor and roughconductor. */
#ifndef WORKER_RENDER_BSDF_METAL_H
#define WORKER_RENDER_BSDF_METAL_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/ior.h"

struct metal {
	struct texture eta, k;
	bool varies;		 /* eta or k is an image or a pattern; these are not yet divided by the index outside */
	double eta_over, k_over; /* that index for what varies, otherwise 1 */
	struct texture reflectance; /* factor */
	bool perfect;		    /* reflects everything: the Fresnel factor is 1 */
};

/* Reads material, eta, k, ext_eta, specular_reflectance. Without any of the first three, the material is Cu in the
 * 0.5/0.6 dialect and none (a perfect mirror) in 3.x. Sets b's colour and texture flags. */
int metal_read(struct metal *m, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
	       struct error *e);
#define METAL_PARAMS                                                                                                  \
	{.name = "material", .types = VALUE_STRING}, {.name = "eta", .types = VALUE_TEXTURE, .max = PARAM_METAL_MAX}, \
		{.name = "k", .types = VALUE_TEXTURE, .max = PARAM_METAL_MAX}, IOR_NUMBER("ext_eta"),                 \
	{                                                                                                             \
		.name = "specular_reflectance", .types = VALUE_TEXTURE, .max = 1                                      \
	}

/* Reflectance for the cosine to the (micro)surface normal. */
spectrum metal_fresnel(const struct metal *m, const struct bsdf_point *p, double cosine);

#endif
