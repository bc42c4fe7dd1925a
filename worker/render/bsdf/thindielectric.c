/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A sheet of glass without thickness: light that enters passes straight through. All reflections between the two sides
 * are included: the sheet reflects R' = 2 R / (1 + R), with R the Fresnel reflectance of one side, as in Mitsuba.
 * Transmitted light is not refracted: b->eta is 1.
 */
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ior.h"
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/microfacet.h"

#include <float.h>

struct thin {
	struct texture reflectance, transmittance;
	double eta; /* index of the glass over that of its surroundings */
};

/* Returns 2 R / (1 + R) and (1 - R) / (1 + R); neither loses precision if it is small. */
static struct fresnel sheet_fresnel(const struct thin *t, vec3 wo)
{
	struct fresnel f = fresnel_dielectric(fmin(fabs(wo.z), 1), t->eta);
	double both = 1 / (1 + f.reflectance);
	return (struct fresnel){2 * f.reflectance * both, f.transmittance * both, 0};
}

static spectrum thin_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				double *probability)
{
	const struct thin *t = b->data;
	struct fresnel f = sheet_fresnel(t, wo);
	bool reflect = mode & BSDF_REFLECT;
	double share = reflect ? f.reflectance : f.transmittance;
	if (!(fabs(wo.z) >= DBL_MIN && share > 0)) /* 1 / wo.z must be finite */
		return spectrum_constant(0);
	*wi = (vec3){-wo.x, -wo.y, reflect ? wo.z : -wo.z};
	*probability = fresnel_reflection_probability(&f, reflect);
	return spectrum_scale(
		share, texture_eval(reflect ? &t->reflectance : &t->transmittance, &p->texture_point, p->wavelengths));
}

static bool thin_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	struct fresnel f = sheet_fresnel(b->data, wo);
	bool reflect = u[2] < fresnel_reflection_probability(&f, true);
	return bsdf_sample_delta(b, p, wo, reflect ? BSDF_REFLECT : BSDF_TRANSMIT | BSDF_STRAIGHT, out);
}

static int thin_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct thin *t = b->data;
	double inside, outside;
	int code = ior_read(n, "int_ior", IOR_BK7_DEFAULT, &inside, e);
	if (!code)
		code = ior_read(n, "ext_ior", IOR_AIR_DEFAULT, &outside, e);
	if (!code)
		code = bsdf_read_texture(b, &t->reflectance, n, "specular_reflectance", 1, build, e);
	if (!code)
		code = bsdf_read_texture(b, &t->transmittance, n, "specular_transmittance", 1, build, e);
	if (code)
		return code;
	t->eta = inside / outside;
	b->modes = BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT;
	b->is_straight_transmitter = true;
	b->has_delta = true;
	b->is_two_sided = true;
	b->min_alpha = b->mean_alpha = 0;
	b->is_black = texture_max(&t->reflectance) == 0 && texture_max(&t->transmittance) == 0;
	return 0;
}

const struct bsdf_ops bsdf_ops_thindielectric = {
	.decl = PLUGIN(BSDF, "thindielectric", IOR_NUMBER("int_ior"), IOR_NUMBER("ext_ior"),
		       {.name = "specular_reflectance", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		       {.name = "specular_transmittance", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		       MICROFACET_PARAMS_IGNORED),
	.data_size = sizeof(struct thin),
	.create = thin_create,
	.eval = bsdf_eval_zero,
	.pdf_solid = bsdf_pdf_zero,
	.eval_delta = thin_eval_delta,
	.sample = thin_sample,
};
