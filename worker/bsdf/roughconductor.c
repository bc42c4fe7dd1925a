/* A rough metal on the side of the normal: Walter et al. 2007, eq. 20, visible normals sampled. */
#include "worker/bsdf/metal.h"
#include "worker/bsdf/microfacet.h"

struct roughconductor {
	struct metal metal;
	struct microfacet facets;
};

/* The facet between the two: its cosine against them, and D G1(wo) / 4 wo.z, the density of wi. */
static bool facet_of(const struct roughconductor *r, vec3 wo, vec3 wi, double *cosine, double *pdf)
{
	vec3 h;
	if (!(wo.z > 0 && wi.z > 0) || !microfacet_half(vec3_add(wo, wi), &h))
		return false;
	*cosine = vec3_dot(wo, h);
	double d = microfacet_d(&r->facets, h);
	if (!(d > 0))
		return false;
	*pdf = 0.25 * d * microfacet_g1_over_cos(&r->facets, wo);
	return *pdf > 0;
}

static spectrum facet_f(const struct bsdf *b, const struct bsdf_point *p, vec3 wi, double cosine, double pdf)
{
	const struct roughconductor *r = b->data;
	return spectrum_scale(pdf * microfacet_g1_over_cos(&r->facets, wi), metal_fresnel(&r->metal, p, cosine));
}

static spectrum roughconductor_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	double cosine, pdf;
	if (!facet_of(b->data, wo, wi, &cosine, &pdf))
		return spectrum_of(0);
	return facet_f(b, p, wi, cosine, pdf);
}

static double roughconductor_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)p;
	double cosine, pdf;
	return facet_of(b->data, wo, wi, &cosine, &pdf) ? pdf : 0;
}

static bool roughconductor_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
				  struct bsdf_sample *out)
{
	const struct roughconductor *r = b->data;
	if (!(wo.z > 0))
		return false;
	vec3 h = microfacet_sample_visible(&r->facets, wo, u[0], u[1]);
	vec3 wi = vec3_normalize(vec3_sub(vec3_scale(2 * vec3_dot(wo, h), h), wo));
	double cosine, pdf;
	if (!facet_of(r, wo, wi, &cosine, &pdf))
		return false;
	*out = (struct bsdf_sample){.wi = wi, .mode = BSDF_REFLECT, .pdf = pdf,
				    .f = facet_f(b, p, wi, cosine, pdf), .eta = 1};
	return true;
}

static int roughconductor_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
				 struct error *e)
{
	struct roughconductor *r = bsdf_data(b, n, build, sizeof *r, e);
	if (!r)
		return -ENOMEM;
	int code = microfacet_read(&r->facets, n, e);
	if (code)
		return code;
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	b->alpha = b->alpha_mean = r->facets.alpha;
	return metal_read(&r->metal, b, n, build, e);
}

static const struct param roughconductor_params[] = {METAL_PARAMS, MICROFACET_PARAMS, {.name = NULL}};

const struct bsdf_ops bsdf_ops_roughconductor = {
	.type = "roughconductor",
	.params = roughconductor_params,
	.create = roughconductor_create,
	.eval = roughconductor_eval,
	.pdf_solid = roughconductor_pdf,
	.sample = roughconductor_sample,
};
