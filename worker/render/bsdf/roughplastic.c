/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A diffuse base under a rough clear coating, which reflects on the side of the normal: coated_diffuse.h with the
 * boundary of rough_boundary.h.
 */
#include "worker/render/bsdf/coated_diffuse.h"
#include "worker/render/bsdf/rough_boundary.h"
#include "worker/render/bsdf/warp.h"

struct roughplastic {
	struct coated_diffuse coating;
	struct rough_boundary boundary;
};

static spectrum roughplastic_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_constant(0);
	struct boundary_point point = rough_boundary_at(&r->boundary, p);
	double pdf, lobe = rough_boundary_reflect(&point, wo, wi, &pdf);
	return spectrum_add(
		coated_diffuse_eval(&r->coating, p, rough_boundary_escape(&point),
				    rough_boundary_transmittance(&point, wo.z),
				    rough_boundary_transmittance(&point, wi.z)),
		spectrum_scale(lobe, texture_eval(&r->coating.specular, &p->texture_point, p->wavelengths)));
}

static double specular_probability(const struct roughplastic *r, const struct boundary_point *point, vec3 wo)
{
	return coated_diffuse_specular_probability(&r->coating, 1 - rough_boundary_transmittance(point, wo.z));
}

static double roughplastic_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return 0;
	struct boundary_point point = rough_boundary_at(&r->boundary, p);
	double lobe, s = specular_probability(r, &point, wo);
	rough_boundary_reflect(&point, wo, wi, &lobe);
	return s * lobe + (1 - s) * wi.z / WARP_PI;
}

static bool roughplastic_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
				struct bsdf_sample *out)
{
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0))
		return false;
	struct boundary_point point = rough_boundary_at(&r->boundary, p);
	vec3 wi = u[2] < specular_probability(r, &point, wo) ? microfacet_sample_mirrored(&point.facets, wo, u[0], u[1])
							     : warp_cosine_hemisphere(u[0], u[1]);
	return bsdf_sample_smooth(b, p, wo, wi, out);
}

static int roughplastic_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			       struct error *e)
{
	struct roughplastic *r = b->data;
	int code = coated_diffuse_read(&r->coating, b, n, build, e);
	/* min_roughness does not apply: an exact mirror above a diffuse base has no advantage. */
	if (!code)
		code = rough_boundary_read(&r->boundary, r->coating.eta, b, n, build, e);
	if (code)
		return code;
	double probability = r->coating.specular_weight;
	if (!(probability > 0))
		b->min_alpha = INFINITY;
	b->mean_alpha = probability * b->mean_alpha + (1 - probability);
	return 0;
}

const struct bsdf_ops bsdf_ops_roughplastic = {
	.decl = PLUGIN(BSDF, "roughplastic", COATED_DIFFUSE_PARAMS, ROUGH_BOUNDARY_PARAMS),
	.data_size = sizeof(struct roughplastic),
	.create = roughplastic_create,
	.eval = roughplastic_eval,
	.pdf_solid = roughplastic_pdf,
	.sample = roughplastic_sample,
};
