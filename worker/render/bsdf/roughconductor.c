/* SPDX-License-Identifier: Apache-2.0 */
/* A rough metal that reflects on the side of the normal: Walter et al. 2007, eq. 20, sampled by visible normals. */
#include "worker/render/bsdf/metal.h"
#include "worker/render/bsdf/rough_map.h"

struct roughconductor {
	struct metal metal; /* first: if created as smooth, the data is that of a `conductor` */
	struct rough_map roughness;
};

/* The facet between two directions. */
struct facet {
	vec3 h;
	double cosine; /* cosine of either direction to h */
	double pdf;    /* D G1(wo) / 4 wo.z, the density of wi */
};

static bool find_facet(const struct microfacet *m, vec3 wo, vec3 wi, struct facet *f)
{
	double length;
	if (!(wo.z > 0 && wi.z > 0) || !microfacet_half_vector(wo, 1, wi, &f->h, &length))
		return false;
	f->cosine = 0.5 * length;
	f->pdf = 0.25 * microfacet_d(m, f->h) * microfacet_g1_over_cos(m, wo);
	return f->pdf > 0;
}

static spectrum eval_facet(const struct roughconductor *r, const struct microfacet *m, const struct bsdf_point *p,
			   vec3 wi, const struct facet *f)
{
	return spectrum_scale(f->pdf * microfacet_g1_over_cos(m, wi), metal_fresnel(&r->metal, p, f->cosine));
}

static spectrum roughconductor_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughconductor *r = b->data;
	struct microfacet m = rough_map_at(&r->roughness, p);
	struct facet f;
	return find_facet(&m, wo, wi, &f) ? eval_facet(r, &m, p, wi, &f) : spectrum_constant(0);
}

static spectrum roughconductor_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughconductor *r = b->data;
	struct microfacet m = rough_map_at(&r->roughness, p);
	struct facet f;
	if (!find_facet(&m, wo, wi, &f))
		return spectrum_constant(0);
	return spectrum_scale(4 * f.cosine * f.h.z * f.h.z * f.h.z * wi.z, eval_facet(r, &m, p, wi, &f));
}

static double roughconductor_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughconductor *r = b->data;
	struct microfacet m = rough_map_at(&r->roughness, p);
	struct facet f;
	return find_facet(&m, wo, wi, &f) ? f.pdf : 0;
}

static bool roughconductor_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
				  struct bsdf_sample *out)
{
	const struct roughconductor *r = b->data;
	if (!(wo.z > 0))
		return false;
	struct microfacet m = rough_map_at(&r->roughness, p);
	vec3 wi = microfacet_sample_mirrored(&m, wo, u[0], u[1]);
	struct facet f;
	if (!find_facet(&m, wo, wi, &f))
		return false;
	*out = (struct bsdf_sample){
		.wi = wi, .mode = BSDF_REFLECT, .pdf = f.pdf, .f = eval_facet(r, &m, p, wi, &f), .eta = 1};
	return true;
}

static int roughconductor_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
				 struct error *e)
{
	struct roughconductor *r = b->data;
	int code = rough_map_read(&r->roughness, b, n, build, e);
	if (code)
		return code;
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	if (!r->roughness.is_textured && b->min_alpha < build->min_roughness) {
		extern const struct bsdf_ops bsdf_ops_conductor;
		bsdf_make_specular(b, &bsdf_ops_conductor);
	}
	return metal_read(&r->metal, b, n, build, e);
}

const struct bsdf_ops bsdf_ops_roughconductor = {
	.decl = PLUGIN(BSDF, "roughconductor", METAL_PARAMS, ROUGH_MAP_PARAMS),
	.data_size = sizeof(struct roughconductor),
	.create = roughconductor_create,
	.eval = roughconductor_eval,
	.pdf_solid = roughconductor_pdf,
	.eval_halfvec = roughconductor_eval_halfvec,
	.sample = roughconductor_sample,
};
