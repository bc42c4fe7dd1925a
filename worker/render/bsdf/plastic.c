/* SPDX-License-Identifier: Apache-2.0 */
/* A diffuse base under a smooth clear coating (coated_diffuse.h), which reflects on the side of the normal. */
#include "worker/render/bsdf/coated_diffuse.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/warp.h"

#include <float.h>

struct plastic {
	struct coated_diffuse coating; /* first: most functions take b->data as a coating */
	double escape;		       /* parameter of coated_diffuse_eval */
};

static struct fresnel fresnel_at(const struct coated_diffuse *c, vec3 w)
{
	return fresnel_dielectric(fmin(w.z, 1), c->eta);
}

static spectrum plastic_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct plastic *s = b->data;
	const struct coated_diffuse *c = &s->coating;
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_constant(0);
	return coated_diffuse_eval(c, p, s->escape, fresnel_at(c, wo).transmittance, fresnel_at(c, wi).transmittance);
}

static double plastic_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)p;
	const struct coated_diffuse *c = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return 0;
	return (1 - coated_diffuse_specular_probability(c, fresnel_at(c, wo).reflectance)) * wi.z / WARP_PI;
}

static spectrum plastic_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				   double *probability)
{
	const struct coated_diffuse *c = b->data;
	if (!(mode & BSDF_REFLECT) || !(wo.z >= DBL_MIN)) /* 1 / wo.z must be finite */
		return spectrum_constant(0);
	double reflected = fresnel_at(c, wo).reflectance;
	*wi = (vec3){-wo.x, -wo.y, wo.z};
	*probability = coated_diffuse_specular_probability(c, reflected);
	return spectrum_scale(reflected, texture_eval(&c->specular, &p->texture_point, p->wavelengths));
}

static bool plastic_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			   struct bsdf_sample *out)
{
	const struct coated_diffuse *c = b->data;
	if (!(wo.z > 0))
		return false;
	if (u[2] < coated_diffuse_specular_probability(c, fresnel_at(c, wo).reflectance))
		return bsdf_sample_delta(b, p, wo, BSDF_REFLECT, out);
	return bsdf_sample_smooth(b, p, wo, warp_cosine_hemisphere(u[0], u[1]), out);
}

/* Returns the share of diffuse light that the boundary lets in: the integral of T over the squared sine, up to total
 * reflection, by the midpoint rule. */
static double diffuse_transmittance(double eta)
{
	enum { STEPS = 4096 };
	double sum = 0, max_sin2 = fmin(eta * eta, 1);
	for (int i = 0; i < STEPS; i++)
		sum += fresnel_dielectric(sqrt(1 - max_sin2 * (i + 0.5) / STEPS), eta).transmittance;
	return max_sin2 * sum / STEPS;
}

static int plastic_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct plastic *s = b->data;
	int code = coated_diffuse_read(&s->coating, b, n, build, e);
	if (code)
		return code;
	s->escape = diffuse_transmittance(s->coating.eta);
	b->modes |= BSDF_DELTA;
	b->has_delta = true;
	b->mean_alpha = 1;
	return 0;
}

const struct bsdf_ops bsdf_ops_plastic = {
	.decl = PLUGIN(BSDF, "plastic", COATED_DIFFUSE_PARAMS, MICROFACET_PARAMS_IGNORED),
	.data_size = sizeof(struct plastic),
	.create = plastic_create,
	.eval = plastic_eval,
	.pdf_solid = plastic_pdf,
	.eval_delta = plastic_eval_delta,
	.sample = plastic_sample,
};
