/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A diffuse base under a rough clear coating, on the side of the normal: coating.h. The boundary is that of
 * roughdielectric (Walter et al. 2007, eq. 20); what it transmits is one minus what it reflects, tabulated over the
 * cosine when the material is made.
 */
#include "worker/render/bsdf/coating.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/warp.h"

enum { NODES = 48, SIDE = 16, STEPS = 1024 };

struct roughplastic {
	struct coating coating;
	struct microfacet facets;
	double transmitted[NODES]; /* from outside, at cosines (i / (NODES - 1))^2 */
};

/* What a rough boundary reflects of light from v, to the same side: visible normals by the midpoint rule. */
static double reflected_by(const struct microfacet *m, double eta, double cosine)
{
	double sum = 0;
	vec3 v = {sqrt((1 - cosine) * (1 + cosine)), 0, cosine};
	for (int i = 0; i < SIDE * SIDE; i++) {
		vec3 h = microfacet_sample_visible(m, v, (i / SIDE + 0.5) / SIDE, (i % SIDE + 0.5) / SIDE);
		double c = fmin(vec3_dot(v, h), 1);
		vec3 w = vec3_sub(vec3_scale(2 * c, h), v);
		if (c > 0 && w.z > 0)
			sum += fresnel_dielectric(c, eta).reflected *
			       fmin(microfacet_g1_over_cos(m, vec3_normalize(w)) * w.z, 1);
	}
	return sum / (SIDE * SIDE);
}

static double node_cosine(int i)
{
	double x = fmax((double)i / (NODES - 1), 1e-3);
	return x * x;
}

static double transmitted(const struct roughplastic *r, double cosine)
{
	double x = sqrt(fmin(cosine, 1)) * (NODES - 1);
	int i = x < NODES - 2 ? (int)x : NODES - 2;
	double t = x - i;
	return (1 - t) * r->transmitted[i] + t * r->transmitted[i + 1];
}

/* Density of wi by the specular lobe: D G1(wo) / 4 wo.z. */
static double facet_pdf(const struct roughplastic *r, vec3 wo, vec3 wi, double *cosine)
{
	double length;
	vec3 h;
	if (!microfacet_half(wo, 1, wi, &h, &length))
		return 0;
	*cosine = fmin(0.5 * length, 1);
	return 0.25 * microfacet_d(&r->facets, h) * microfacet_g1_over_cos(&r->facets, wo);
}

static spectrum roughplastic_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_of(0);
	double cosine = 1, lobe = facet_pdf(r, wo, wi, &cosine);
	lobe *= microfacet_g1_over_cos(&r->facets, wi) * fresnel_dielectric(cosine, r->coating.eta).reflected;
	return spectrum_add(coating_diffuse(&r->coating, p, transmitted(r, wo.z), transmitted(r, wi.z)),
			    spectrum_scale(lobe, texture_eval(&r->coating.specular, p->u, p->v, p->w)));
}

static double specular_chance(const struct roughplastic *r, vec3 wo)
{
	return coating_specular_chance(&r->coating, 1 - transmitted(r, wo.z));
}

static double roughplastic_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)p;
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return 0;
	double cosine, s = specular_chance(r, wo);
	return s * facet_pdf(r, wo, wi, &cosine) + (1 - s) * wi.z / WARP_PI;
}

static bool roughplastic_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
				struct bsdf_sample *out)
{
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0))
		return false;
	vec3 wi;
	if (u[2] < specular_chance(r, wo)) {
		vec3 h = microfacet_sample_visible(&r->facets, wo, u[0], u[1]);
		wi = vec3_normalize(vec3_sub(vec3_scale(2 * vec3_dot(wo, h), h), wo));
	} else {
		wi = warp_cosine_hemisphere(u[0], u[1]);
	}
	double pdf = roughplastic_pdf(b, p, wo, wi);
	if (!(pdf > 0))
		return false;
	*out = (struct bsdf_sample){
		.wi = wi, .mode = BSDF_REFLECT, .pdf = pdf, .f = roughplastic_eval(b, p, wo, wi), .eta = 1};
	return true;
}

static void tabulate(struct roughplastic *r)
{
	double sum = 0;
	for (int i = 0; i < NODES; i++)
		r->transmitted[i] = 1 - reflected_by(&r->facets, r->coating.eta, node_cosine(i));
	for (int i = 0; i < STEPS; i++) {
		double c = (i + 0.5) / STEPS;
		sum += transmitted(r, c) * 2 * c;
	}
	r->coating.escape = sum / STEPS;
}

static int roughplastic_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			       struct error *e)
{
	struct roughplastic *r = bsdf_data(b, n, build, sizeof *r, e);
	if (!r)
		return -ENOMEM;
	int code = microfacet_read(&r->facets, n, e);
	if (!code && r->facets.ratio != 1)
		code = node_error(n, e, ENOTSUP, "alpha_u and alpha_v differ; only isotropic coatings are supported");
	if (!code)
		code = coating_read(&r->coating, b, n, build, e);
	if (code)
		return code;
	/* A diffuse base has nothing to gain from an exact mirror above it: the coating stays rough, as smooth as it
	 * may be. */
	tabulate(r);
	double chance = r->coating.specular_weight;
	b->alpha = chance > 0 ? microfacet_least(&r->facets) : INFINITY;
	b->alpha_mean = chance * microfacet_mean(&r->facets) + (1 - chance);
	return 0;
}

static const struct param roughplastic_params[] = {COATING_PARAMS, MICROFACET_PARAMS, {.name = NULL}};

const struct bsdf_ops bsdf_ops_roughplastic = {
	.type = "roughplastic",
	.params = roughplastic_params,
	.create = roughplastic_create,
	.eval = roughplastic_eval,
	.pdf_solid = roughplastic_pdf,
	.sample = roughplastic_sample,
};
