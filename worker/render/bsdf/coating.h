/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A clear coating over a diffuse base, what `plastic` and `roughplastic` share: light that the boundary lets in is
 * scattered by the base, reflected again and again between base and boundary, and leaves through the boundary (the
 * model of Mitsuba's plug-ins):
 *
 *   f_diffuse = T(wo) T(wi) / eta^2  rho / (1 - rho' (1 - E)) / pi
 *
 * with T the share that the boundary transmits from outside, E what it lets out of diffuse light from inside, rho the
 * base's reflectance, and rho' = rho where `nonlinear` is on, which shifts colours as light does that meets the base
 * several times, else 1. By reciprocity E is what it lets in of diffuse light from outside, over eta^2: so a white base
 * gives back all light, and nothing is lost to rounding where E is small.
 */
#ifndef WORKER_RENDER_BSDF_COATING_H
#define WORKER_RENDER_BSDF_COATING_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/ior.h"

#define COATING_IOR_DEFAULT 1.49 /* polypropylene, the default of both Mitsuba dialects */

struct coating {
	struct texture diffuse, specular;
	double eta;		/* index of the coating over the one outside */
	double specular_weight; /* share of the specular reflectance, used to choose a lobe */
	bool nonlinear;
};

/* Reads the parameters into b. */
int coating_read(struct coating *c, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		 struct error *e);
#define COATING_PARAMS                                                                        \
	IOR_NUMBER("int_ior"), IOR_NUMBER("ext_ior"),                                         \
		{.name = "diffuse_reflectance", .types = VALUE_TEXTURE, .min = 0, .max = 1},  \
		{.name = "specular_reflectance", .types = VALUE_TEXTURE, .min = 0, .max = 1}, \
	{                                                                                     \
		.name = "nonlinear", .types = VALUE_BOOL                                      \
	}

/* f_diffuse; escape: E eta^2. */
spectrum coating_diffuse(const struct coating *c, const struct bsdf_point *p, double escape, double transmitted_o,
			 double transmitted_i);

/* The probability of sampling the specular lobe, given the share `reflected` of wo's light that the boundary
 * reflects. */
double coating_specular_chance(const struct coating *c, double reflected);

#endif
