/* What dielectric and roughdielectric share: the index and the factors of the two modes. */
#ifndef WORKER_BSDF_GLASS_H
#define WORKER_BSDF_GLASS_H

#include "worker/bsdf/create.h"

struct glass {
	struct texture reflectance, transmittance; /* multiply */
};

/* Parameters int_ior, ext_ior, specular_reflectance, specular_transmittance. Sets b->eta and enters the colours. */
int glass_read(struct glass *g, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
	       struct error *e);
#define GLASS_PARAMS                                                                                                   \
	{.name = "int_ior", .types = VALUE_FLOAT | VALUE_INT | VALUE_STRING},                                          \
	{.name = "ext_ior", .types = VALUE_FLOAT | VALUE_INT | VALUE_STRING},                                          \
	{.name = "specular_reflectance", .types = VALUE_TEXTURE},                                                      \
	{.name = "specular_transmittance", .types = VALUE_TEXTURE}

#endif
