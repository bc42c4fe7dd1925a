/* SPDX-License-Identifier: Apache-2.0 */
/* A smooth metal that reflects on the side of the normal only. */
#include "worker/render/bsdf/metal.h"
#include "worker/render/bsdf/microfacet.h"

#include <float.h>

static spectrum conductor_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				     double *probability)
{
	if (!(mode & BSDF_REFLECT) || !(wo.z >= DBL_MIN)) /* 1 / wo.z must be finite */
		return spectrum_constant(0);
	*wi = (vec3){-wo.x, -wo.y, wo.z};
	*probability = 1;
	return metal_fresnel(b->data, p, wo.z);
}

static bool conductor_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			     struct bsdf_sample *out)
{
	(void)u;
	return bsdf_sample_delta(b, p, wo, BSDF_REFLECT, out);
}

static int conductor_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct metal *m = b->data;
	b->modes = BSDF_REFLECT | BSDF_DELTA;
	b->has_delta = true;
	b->min_alpha = 0;
	return metal_read(m, b, n, build, e);
}

const struct bsdf_ops bsdf_ops_conductor = {
	.decl = PLUGIN(BSDF, "conductor", METAL_PARAMS, MICROFACET_PARAMS_IGNORED),
	.data_size = sizeof(struct metal),
	.create = conductor_create,
	.eval = bsdf_eval_zero,
	.pdf_solid = bsdf_pdf_zero,
	.eval_delta = conductor_eval_delta,
	.sample = conductor_sample,
};
