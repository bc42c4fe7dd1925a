/* SPDX-License-Identifier: Apache-2.0 */
/* A smooth boundary between two transparent media: Fresnel's reflection and Snell's refraction. */
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/glass.h"
#include "worker/render/bsdf/microfacet.h"

#include <float.h>

/* Returns f |wi.z| of one lobe, given the Fresnel terms f at its angle. eta: index beyond over index on wo's side.
 * *probability is 0 if there is no such lobe. */
static spectrum eval_lobe(const struct glass *g, const struct bsdf_point *p, vec3 wo, unsigned mode, double eta,
			  const struct fresnel *f, vec3 *wi, double *probability)
{
	*probability = 0;
	if (mode & BSDF_REFLECT) {
		if (!(fabs(wo.z) >= DBL_MIN && f->reflectance > 0)) /* 1 / wo.z must be finite */
			return spectrum_constant(0);
		*wi = (vec3){-wo.x, -wo.y, wo.z};
		*probability = fresnel_reflection_probability(f, true);
		return spectrum_scale(f->reflectance, texture_eval(&g->reflectance, &p->texture_point, p->wavelengths));
	}
	if (!(f->cos_t >= DBL_MIN && f->transmittance > 0))
		return spectrum_constant(0);
	double scale = p->transport == TRANSPORT_RADIANCE ? 1 / (eta * eta) : 1;
	*wi = (vec3){-wo.x / eta, -wo.y / eta, -copysign(f->cos_t, wo.z)};
	*probability = fresnel_reflection_probability(f, false);
	return spectrum_scale(f->transmittance * scale,
			      texture_eval(&g->transmittance, &p->texture_point, p->wavelengths));
}

static double eta_beyond(const struct bsdf *b, const struct bsdf_point *p, vec3 wo)
{
	double eta = bsdf_eta(b, p->wavelengths);
	return wo.z > 0 ? eta : 1 / eta;
}

static spectrum dielectric_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode,
				      vec3 *wi, double *probability)
{
	double eta = eta_beyond(b, p, wo);
	struct fresnel f = fresnel_dielectric(fmin(fabs(wo.z), 1), eta);
	return eval_lobe(b->data, p, wo, mode, eta, &f, wi, probability);
}

static bool dielectric_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			      struct bsdf_sample *out)
{
	double eta = eta_beyond(b, p, wo);
	struct fresnel f = fresnel_dielectric(fmin(fabs(wo.z), 1), eta);
	bool reflect = u[2] < fresnel_reflection_probability(&f, true);
	*out = (struct bsdf_sample){.mode = (reflect ? BSDF_REFLECT : BSDF_TRANSMIT) | BSDF_DELTA,
				    .eta = reflect ? 1 : eta};
	spectrum weight = eval_lobe(b->data, p, wo, out->mode, eta, &f, &out->wi, &out->pdf);
	if (!(out->pdf > 0))
		return false;
	out->f = spectrum_scale(1 / fabs(out->wi.z), weight);
	return true;
}

static int dielectric_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			     struct error *e)
{
	struct glass *g = b->data;
	b->modes = BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA;
	b->has_delta = true;
	b->min_alpha = 0;
	return glass_read(g, b, n, build, e);
}

const struct bsdf_ops bsdf_ops_dielectric = {
	.decl = PLUGIN(BSDF, "dielectric", GLASS_PARAMS, MICROFACET_PARAMS_IGNORED),
	.data_size = sizeof(struct glass),
	.create = dielectric_create,
	.eval = bsdf_eval_zero,
	.pdf_solid = bsdf_pdf_zero,
	.eval_delta = dielectric_eval_delta,
	.sample = dielectric_sample,
};
