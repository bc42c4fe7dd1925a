/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A diffuse base under a rough clear coating, which reflects on the side of the normal: coating.h with the boundary of
 * rough_boundary.h.
 */
#include "worker/render/bsdf/coating.h"
#include "worker/render/bsdf/rough_boundary.h"
#include "worker/render/bsdf/warp.h"

struct roughplastic {
	struct coating coating;
	struct rough_boundary boundary;
};

static spectrum roughplastic_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return spectrum_of(0);
	struct boundary_point at = rough_boundary_at(&r->boundary, p);
	double pdf, lobe = boundary_reflect(&at, wo, wi, &pdf);
	return spectrum_add(coating_diffuse(&r->coating, p, boundary_escape(&at), boundary_transmitted(&at, wo.z),
					    boundary_transmitted(&at, wi.z)),
			    spectrum_scale(lobe, texture_eval(&r->coating.specular, &p->where, p->w)));
}

static double specular_chance(const struct roughplastic *r, const struct boundary_point *at, vec3 wo)
{
	return coating_specular_chance(&r->coating, 1 - boundary_transmitted(at, wo.z));
}

static double roughplastic_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0 && wi.z > 0))
		return 0;
	struct boundary_point at = rough_boundary_at(&r->boundary, p);
	double lobe, s = specular_chance(r, &at, wo);
	boundary_reflect(&at, wo, wi, &lobe);
	return s * lobe + (1 - s) * wi.z / WARP_PI;
}

static bool roughplastic_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
				struct bsdf_sample *out)
{
	const struct roughplastic *r = b->data;
	if (!(wo.z > 0))
		return false;
	struct boundary_point at = rough_boundary_at(&r->boundary, p);
	vec3 wi = u[2] < specular_chance(r, &at, wo) ? microfacet_sample_mirrored(&at.facets, wo, u[0], u[1])
						     : warp_cosine_hemisphere(u[0], u[1]);
	return bsdf_sample_smooth(b, p, wo, wi, out);
}

static int roughplastic_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			       struct error *e)
{
	struct roughplastic *r = b->data;
	int code = coating_read(&r->coating, b, n, build, e);
	/* least_roughness does not apply: an exact mirror above a diffuse base has no advantage. */
	if (!code)
		code = rough_boundary_read(&r->boundary, r->coating.eta, b, n, build, e);
	if (code)
		return code;
	double chance = r->coating.specular_weight;
	if (!(chance > 0))
		b->alpha = INFINITY;
	b->alpha_mean = chance * b->alpha_mean + (1 - chance);
	return 0;
}

const struct bsdf_ops bsdf_ops_roughplastic = {
	.decl = PLUGIN(BSDF, "roughplastic", COATING_PARAMS, ROUGH_BOUNDARY_PARAMS),
	.data_size = sizeof(struct roughplastic),
	.create = roughplastic_create,
	.eval = roughplastic_eval,
	.pdf_solid = roughplastic_pdf,
	.sample = roughplastic_sample,
};
