/* SPDX-License-Identifier: Apache-2.0 */
/* The index and the factors of reflection and transmission, shared by `dielectric` and `roughdielectric`. */
#ifndef WORKER_RENDER_BSDF_GLASS_H
#define WORKER_RENDER_BSDF_GLASS_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/ior.h"

struct glass {
	struct texture reflectance, transmittance; /* factors of the Fresnel terms */
	struct ior side[2];			   /* by enum ior_side */
};

/* Reads the parameters of the index, specular_reflectance and specular_transmittance. Sets b->eta, b->ior,
 * b->is_dispersive and the colour flags; g must outlive b. Returns 0 or a negative error code. */
int glass_read(struct glass *g, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
	       struct error *e);
#define GLASS_PARAMS                                                                    \
	IOR_PARAMS, {.name = "specular_reflectance", .types = VALUE_TEXTURE, .max = 1}, \
	{                                                                               \
		.name = "specular_transmittance", .types = VALUE_TEXTURE, .max = 1      \
	}

#endif
