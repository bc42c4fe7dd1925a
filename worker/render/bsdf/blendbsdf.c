/* SPDX-License-Identifier: Apache-2.0 */
/* Two opaque BSDFs, mixed by a weight: 0 is the first, 1 the second. */
#include "worker/render/bsdf/create.h"

struct blend {
	struct bsdf part[2];
	struct texture weight;
};

/* Share of each part. */
static void shares(const struct blend *m, const struct bsdf_point *p, spectrum share[2])
{
	share[1] = texture_eval(&m->weight, p->u, p->v, p->w);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		share[0].v[i] = 1 - share[1].v[i];
}

static spectrum mix(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi,
		    spectrum (*eval)(const struct bsdf *, const struct bsdf_point *, vec3, vec3))
{
	const struct blend *m = b->data;
	spectrum share[2];
	shares(m, p, share);
	return spectrum_add(spectrum_mul(share[0], eval(&m->part[0], p, wo, wi)),
			    spectrum_mul(share[1], eval(&m->part[1], p, wo, wi)));
}

static spectrum part_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	return b->ops->eval(b, p, wo, wi);
}

static spectrum blend_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	return mix(b, p, wo, wi, part_eval);
}

static spectrum blend_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	return mix(b, p, wo, wi, bsdf_eval_halfvec);
}

static double blend_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct blend *m = b->data;
	spectrum share[2];
	shares(m, p, share);
	return spectrum_mean(share[0]) * m->part[0].ops->pdf_solid(&m->part[0], p, wo, wi) +
	       spectrum_mean(share[1]) * m->part[1].ops->pdf_solid(&m->part[1], p, wo, wi);
}

/* Mirrors of both parts look the same way. */
static spectrum blend_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				 double *chance)
{
	const struct blend *m = b->data;
	spectrum share[2], sum = spectrum_of(0);
	double all = 0;
	shares(m, p, share);
	for (int k = 0; k < 2; k++) {
		double one;
		spectrum weight = bsdf_eval_delta(&m->part[k], p, wo, mode, wi, &one);
		if (spectrum_is_zero(weight))
			continue;
		sum = spectrum_add(sum, spectrum_mul(share[k], weight));
		all += spectrum_mean(share[k]) * one;
	}
	*chance = all;
	return sum;
}

static bool blend_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			 struct bsdf_sample *out)
{
	const struct blend *m = b->data;
	spectrum share[2];
	shares(m, p, share);
	double first = spectrum_mean(share[0]);
	int k = u[2] >= first;
	const double rest[3] = {u[0], u[1], fmin(k ? (u[2] - first) / (1 - first) : u[2] / first, 1 - 0x1p-53)};
	if (!m->part[k].ops->sample(&m->part[k], p, wo, rest, out))
		return false;
	if (out->mode & BSDF_DELTA) {
		spectrum weight = blend_eval_delta(b, p, wo, out->mode, &out->wi, &out->pdf);
		out->f = spectrum_scale(1 / fabs(out->wi.z), weight);
	} else {
		out->pdf = blend_pdf(b, p, wo, out->wi);
		out->f = blend_eval(b, p, wo, out->wi);
	}
	return out->pdf > 0;
}

static int blend_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct blend *m = bsdf_data(b, n, build, sizeof *m, e);
	if (!m)
		return -ENOMEM;
	b->alpha_mean = 0;
	for (uint32_t k = 0; k < 2; k++) {
		const struct scene_node *inner = node_child(n, PLUGIN_BSDF, k);
		if (!inner || node_child(n, PLUGIN_BSDF, 2))
			return node_error(n, e, EINVAL, "needs exactly two BSDFs inside");
		struct bsdf *part = &m->part[k];
		int code = bsdf_create(part, inner, build, e);
		if (!code && (part->modes & BSDF_TRANSMIT))
			code = node_error(n, e, ENOTSUP,
					  "a blend with \"%s\", which lets light through, is not supported",
					  inner->type);
		if (!code)
			code = bsdf_take_relief(b, part, k == 0, n, e);
		if (code)
			return code;
		b->two_sided |= part->two_sided;
		b->modes |= part->modes;
		b->has_smooth |= part->has_smooth;
		b->has_delta |= part->has_delta;
		b->textured |= part->textured;
		b->alpha_mean += 0.5 * part->alpha_mean;
		bsdf_add_shape(b, part->shape);
	}
	b->black = m->part[0].black && m->part[1].black;
	b->alpha = fmin(m->part[0].has_smooth ? m->part[0].alpha : INFINITY,
			m->part[1].has_smooth ? m->part[1].alpha : INFINITY);
	if (!b->has_smooth)
		b->alpha = 0;
	for (int k = 0; k < 2 && b->two_sided; k++) {
		int code = bsdf_mirror_back(&m->part[k], build->arena, e);
		if (code)
			return code;
	}
	return bsdf_texture(b, &m->weight, n, "weight", 0.5, build, e);
}

static const struct param blend_params[] = {{.name = "weight", .types = VALUE_TEXTURE, .min = 0, .max = 1},
					    {.name = NULL}};

const struct bsdf_ops bsdf_ops_blendbsdf = {
	.type = "blendbsdf",
	.params = blend_params,
	.nested_classes = 1 << PLUGIN_BSDF,
	.create = blend_create,
	.eval = blend_eval,
	.pdf_solid = blend_pdf,
	.eval_halfvec = blend_eval_halfvec,
	.eval_delta = blend_eval_delta,
	.sample = blend_sample,
};
