/* SPDX-License-Identifier: Apache-2.0 */
/* A path counts one more edge for a filter, and next event estimation does not look through it. */
#include "worker/render/bsdf/straight.h"

#include <float.h>

/* 1 / |wo.z| must be finite. */
static bool straight_direction(vec3 wo, vec3 *wi)
{
	*wi = vec3_neg(wo);
	return fabs(wo.z) >= DBL_MIN;
}

spectrum straight_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			     double *chance)
{
	const struct filter *f = b->data;
	if (!(mode & BSDF_TRANSMIT) || !straight_direction(wo, wi))
		return spectrum_of(0);
	*chance = 1;
	return spectrum_scale(f->share, texture_eval(&f->transmittance, &p->where, p->w));
}

bool straight_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		     struct bsdf_sample *out)
{
	(void)u;
	return bsdf_sample_delta(b, p, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, out);
}

int straight_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, double share,
		    struct error *e)
{
	struct filter *f = b->data;
	int code = bsdf_texture(b, &f->transmittance, n, "transmittance", 1, build, e);
	if (code)
		return code;
	f->share = share;
	b->modes = BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT;
	b->only_straight = true;
	b->has_delta = true;
	b->two_sided = true;
	b->alpha = b->alpha_mean = 0;
	b->black = texture_max(&f->transmittance) == 0;
	return 0;
}
