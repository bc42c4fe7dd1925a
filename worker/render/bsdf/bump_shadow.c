/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/bump_shadow.h"

#include "worker/render/bsdf/create.h"

static double square_of_tangent(double cosine)
{
	double c2 = cosine * cosine;
	return fmax(1 - c2, 0) / c2;
}

/* Where the surface faces away by 90 degrees G is 0, or 1 if the normal is not bent. */
static double shadow(const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	if (!p->place.frame)
		return 1;
	vec3 light = p->transport == TRANSPORT_RADIANCE ? wi : wo, n = p->place.frame(p->place.point, NULL).n;
	double a2 = fmin(square_of_tangent(n.z) / 8, 1);
	return a2 > 0 ? 2 / (1 + sqrt(1 + a2 * square_of_tangent(vec3_dot(n, light)))) : 1;
}

static spectrum shadowed_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct bsdf *inner = b->data;
	return spectrum_scale(shadow(p, wo, wi), inner->ops->eval(inner, p, wo, wi));
}

static double shadowed_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct bsdf *inner = b->data;
	return inner->ops->pdf_solid(inner, p, wo, wi);
}

/* Of radiance: wi is towards the light. */
static spectrum shadowed_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct bsdf_point radiance = *p;
	radiance.transport = TRANSPORT_RADIANCE;
	return spectrum_scale(shadow(&radiance, wo, wi), bsdf_eval_halfvec(b->data, p, wo, wi));
}

static spectrum shadowed_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				    double *chance)
{
	spectrum weight = bsdf_eval_delta(b->data, p, wo, mode, wi, chance);
	return spectrum_is_zero(weight) ? weight : spectrum_scale(shadow(p, wo, *wi), weight);
}

static bool shadowed_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			    struct bsdf_sample *out)
{
	const struct bsdf *inner = b->data;
	if (!inner->ops->sample(inner, p, wo, u, out))
		return false;
	out->f = spectrum_scale(shadow(p, wo, out->wi), out->f);
	return true;
}

static const struct bsdf_ops shadowed_ops = {
	.decl.type = "bump_shadow",
	.eval = shadowed_eval,
	.pdf_solid = shadowed_pdf,
	.eval_halfvec = shadowed_eval_halfvec,
	.eval_delta = shadowed_eval_delta,
	.sample = shadowed_sample,
};

int bsdf_shadow_bumps(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	b->uses_place = true;
	return bsdf_wrap(b, &shadowed_ops, n, build, e);
}
