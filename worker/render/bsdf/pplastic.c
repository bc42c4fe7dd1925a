/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Mitsuba 3's polarized plastic (Baek et al. 2018) for unpolarised light, the only kind that is modelled: a rough
 * dielectric boundary, and a diffuse lobe whose light enters and leaves through a smooth one. With Fresnel's
 * reflectance F and transmittance T,
 *
 *   f = specular F(wo.h) D G1 G1 / (4 cos cos) + diffuse T(wo) T(wi) / pi
 *
 * Only the side of the normal reflects. Light that the boundary reflects back inside is lost, unlike in `roughplastic`.
 */
#include "worker/render/bsdf/coated_diffuse.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/rough_map.h"
#include "worker/render/bsdf/warp.h"

struct pplastic {
	struct coated_diffuse coating;
	struct rough_map roughness;
};

static struct fresnel fresnel_at(const struct pplastic *s, double cosine)
{
	return fresnel_dielectric(fmin(cosine, 1), s->coating.eta);
}

static spectrum pplastic_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct pplastic *s = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_constant(0);
	struct microfacet m = rough_map_at(&s->roughness, p);
	double pdf, lobe = microfacet_reflect(&m, s->coating.eta, wo, wi, &pdf),
		    passes = fresnel_at(s, wo.z).transmittance * fresnel_at(s, wi.z).transmittance / WARP_PI;
	return spectrum_add(
		spectrum_scale(lobe, texture_eval(&s->coating.specular, &p->texture_point, p->wavelengths)),
		spectrum_scale(passes, texture_eval(&s->coating.diffuse, &p->texture_point, p->wavelengths)));
}

static double specular_probability(const struct pplastic *s, vec3 wo)
{
	return coated_diffuse_specular_probability(&s->coating, fresnel_at(s, wo.z).reflectance);
}

static double pplastic_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct pplastic *s = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return 0;
	struct microfacet m = rough_map_at(&s->roughness, p);
	double lobe, probability = specular_probability(s, wo);
	microfacet_reflect(&m, s->coating.eta, wo, wi, &lobe);
	return probability * lobe + (1 - probability) * wi.z / WARP_PI;
}

static bool pplastic_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			    struct bsdf_sample *out)
{
	const struct pplastic *s = b->data;
	if (!(wo.z > 0))
		return false;
	vec3 wi;
	if (u[2] < specular_probability(s, wo)) {
		struct microfacet m = rough_map_at(&s->roughness, p);
		wi = microfacet_sample_mirrored(&m, wo, u[0], u[1]);
	} else {
		wi = warp_cosine_hemisphere(u[0], u[1]);
	}
	return bsdf_sample_smooth(b, p, wo, wi, out);
}

static int pplastic_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct pplastic *s = b->data;
	int code = coated_diffuse_read(&s->coating, b, n, build, e);
	if (!code)
		code = rough_map_read(&s->roughness, b, n, build, e);
	if (code)
		return code;
	double probability = s->coating.specular_weight;
	if (!(probability > 0))
		b->min_alpha = INFINITY;
	b->mean_alpha = probability * b->mean_alpha + (1 - probability);
	return 0;
}

const struct bsdf_ops bsdf_ops_pplastic = {
	.decl = PLUGIN(BSDF, "pplastic", IOR_NUMBER("int_ior"), IOR_NUMBER("ext_ior"),
		       {.name = "diffuse_reflectance", .types = VALUE_TEXTURE, .min = 0, .max = 1},
		       {.name = "specular_reflectance", .types = VALUE_TEXTURE, .min = 0, .max = 1}, ROUGH_MAP_PARAMS),
	.data_size = sizeof(struct pplastic),
	.create = pplastic_create,
	.eval = pplastic_eval,
	.pdf_solid = pplastic_pdf,
	.sample = pplastic_sample,
};
