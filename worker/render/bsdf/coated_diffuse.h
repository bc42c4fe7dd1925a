/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A clear coating over a diffuse base, shared by `plastic` and `roughplastic`; `pplastic` uses only its parameters and
 * the choice of a lobe. Light that enters through the boundary is scattered by the base, reflected any number of times
 * between base and boundary, and leaves through the boundary (the model of Mitsuba's plug-ins):
 *
 *   f_diffuse = T(wo) T(wi) / eta^2  rho / (1 - rho' (1 - E)) / pi
 *
 * T is the share of light from outside that the boundary transmits, E the share of diffuse light from inside that it
 * lets out, and rho the reflectance of the base. rho' is 1, or rho if `is_nonlinear` is set: then colours become more
 * saturated, as those of light that meets the base several times. By reciprocity, E is the share of diffuse light from
 * outside that the boundary lets in, over eta^2; with this form a white base loses no light, and a small E loses no
 * precision.
 */
#ifndef WORKER_RENDER_BSDF_COATED_DIFFUSE_H
#define WORKER_RENDER_BSDF_COATED_DIFFUSE_H

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/ior.h"

#define COATED_DIFFUSE_IOR_DEFAULT 1.49 /* polypropylene, the default of both Mitsuba dialects */

struct coated_diffuse {
	struct texture diffuse, specular;
	double eta;		/* index of the coating over the one outside */
	double specular_weight; /* specular reflectance over the sum of both, to choose a lobe */
	bool is_nonlinear;
};

/* Reads the parameters into c, and sets b's modes, colour and texture flags. Returns 0 or a negative error code. */
int coated_diffuse_read(struct coated_diffuse *c, struct bsdf *b, const struct scene_node *n,
			const struct bsdf_build *build, struct error *e);
#define COATED_DIFFUSE_PARAMS                                                                 \
	IOR_NUMBER("int_ior"), IOR_NUMBER("ext_ior"),                                         \
		{.name = "diffuse_reflectance", .types = VALUE_TEXTURE, .min = 0, .max = 1},  \
		{.name = "specular_reflectance", .types = VALUE_TEXTURE, .min = 0, .max = 1}, \
	{                                                                                     \
		.name = "nonlinear", .types = VALUE_BOOL                                      \
	}

/* Returns f_diffuse (1/sr). escape: E eta^2; transmitted_o, transmitted_i: T(wo), T(wi). */
spectrum coated_diffuse_eval(const struct coated_diffuse *c, const struct bsdf_point *p, double escape,
			     double transmitted_o, double transmitted_i);

/* Returns the probability of sampling the specular lobe. reflected: the share of wo's light that the boundary
 * reflects. */
double coated_diffuse_specular_probability(const struct coated_diffuse *c, double reflected);

#endif
