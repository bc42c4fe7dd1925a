/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An opaque BSDF with holes: it scatters the share `opacity` of the light, the rest passes straight through. The latter
 * is a specular lobe, so a path counts one more edge for it, and next event estimation does not look through.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/straight.h"
#include "worker/render/bsdf/twosided.h"

struct mask {
	struct bsdf inner;
	struct texture opacity;
};

static spectrum opacity_at(const struct mask *m, const struct bsdf_point *p)
{
	return texture_eval(&m->opacity, &p->where, p->w);
}

static spectrum mask_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct mask *m = b->data;
	return spectrum_mul(opacity_at(m, p), m->inner.ops->eval(&m->inner, p, wo, wi));
}

static double mask_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct mask *m = b->data;
	return spectrum_mean(opacity_at(m, p)) * m->inner.ops->pdf_solid(&m->inner, p, wo, wi);
}

static spectrum mask_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct mask *m = b->data;
	return spectrum_mul(opacity_at(m, p), bsdf_eval_halfvec(&m->inner, p, wo, wi));
}

static spectrum mask_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				double *chance)
{
	const struct mask *m = b->data;
	spectrum opacity = opacity_at(m, p), weight = opacity;
	double met = spectrum_mean(opacity);
	if (mode & BSDF_TRANSMIT) {
		if (!straight_direction(wo, wi))
			return spectrum_of(0);
		*chance = 1 - met;
		for (int i = 0; i < SPECTRUM_LANES; i++)
			weight.v[i] = 1 - opacity.v[i];
		return weight;
	}
	weight = spectrum_mul(opacity, bsdf_eval_delta(&m->inner, p, wo, mode, wi, chance));
	if (!spectrum_is_zero(weight))
		*chance *= met;
	return weight;
}

static bool mask_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	const struct mask *m = b->data;
	spectrum opacity = opacity_at(m, p);
	double met = spectrum_mean(opacity);
	if (u[2] >= met) {
		*out = (struct bsdf_sample){.mode = BSDF_TRANSMIT | BSDF_DELTA, .eta = 1};
		spectrum weight = mask_eval_delta(b, p, wo, BSDF_TRANSMIT, &out->wi, &out->pdf);
		if (!(out->pdf > 0))
			return false;
		out->f = spectrum_scale(1 / fabs(wo.z), weight);
		return true;
	}
	const double rest[3] = {u[0], u[1], fmin(u[2] / met, 1 - 0x1p-53)};
	if (!m->inner.ops->sample(&m->inner, p, wo, rest, out))
		return false;
	out->pdf *= met;
	out->f = spectrum_mul(opacity, out->f);
	return out->pdf > 0;
}

static int mask_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct mask *m = bsdf_data(b, n, build, sizeof *m, e);
	if (!m)
		return -ENOMEM;
	const struct scene_node *inner = node_child(n, PLUGIN_BSDF, 0);
	if (!inner || node_child(n, PLUGIN_BSDF, 1))
		return node_error(n, e, EINVAL, "needs exactly one BSDF inside");
	int code = bsdf_create(&m->inner, inner, build, e);
	if (!code && (m->inner.modes & BSDF_TRANSMIT))
		code = node_error(n, e, ENOTSUP, "a mask over \"%s\", which transmits light itself, is not supported",
				  inner->type);
	if (!code)
		code = bsdf_mirror_back(&m->inner, build, e);
	if (!code)
		code = bsdf_texture(b, &m->opacity, n, "opacity", 0.5, build, e);
	if (code)
		return code;
	b->relief = m->inner.relief;
	b->modes = m->inner.modes | BSDF_TRANSMIT | BSDF_DELTA;
	b->has_smooth = m->inner.has_smooth;
	b->has_delta = true;
	b->two_sided = true;
	b->textured |= m->inner.textured;
	b->alpha = m->inner.has_smooth ? m->inner.alpha : 0;
	b->alpha_mean = m->inner.alpha_mean;
	bsdf_add_shape(b, m->inner.shape);
	return 0;
}

static const struct param mask_params[] = {{.name = "opacity", .types = VALUE_TEXTURE, .min = 0, .max = 1},
					   {.name = NULL}};

const struct bsdf_ops bsdf_ops_mask = {
	.type = "mask",
	.params = mask_params,
	.nested_classes = 1 << PLUGIN_BSDF,
	.create = mask_create,
	.eval = mask_eval,
	.pdf_solid = mask_pdf,
	.eval_halfvec = mask_eval_halfvec,
	.eval_delta = mask_eval_delta,
	.sample = mask_sample,
};
