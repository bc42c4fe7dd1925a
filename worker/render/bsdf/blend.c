/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/blend.h"

#include "worker/render/bsdf/tilted.h"
#include "worker/render/bsdf/twosided.h"

/* The light that each part scatters, and the probability with which a sample chooses that part. */
struct part_weights {
	spectrum weight[BLEND_PARTS_MAX];
	double probability[BLEND_PARTS_MAX];
};

static void compute_part_weights(const struct blend *m, const struct bsdf_point *p, struct part_weights *s)
{
	double sum = 0;
	if (!m->has_fixed_weights) {
		int weighted_part = m->is_weight_of_first ? 0 : 1;
		spectrum weight = texture_eval(&m->weight, &p->texture_point, p->wavelengths);
		s->weight[weighted_part] = weight;
		for (int i = 0; i < SPECTRUM_LANES; i++)
			s->weight[1 - weighted_part].v[i] = 1 - weight.v[i];
		s->probability[0] = spectrum_mean(s->weight[0]);
		s->probability[1] = spectrum_mean(s->weight[1]);
		return;
	}
	for (uint32_t k = 0; k < m->count; k++)
		sum += m->fixed_weight[k];
	for (uint32_t k = 0; k < m->count; k++) {
		s->weight[k] = spectrum_constant(m->fixed_weight[k]);
		s->probability[k] = m->fixed_weight[k] / sum;
	}
}

static spectrum mix_eval(const struct blend *m, const struct part_weights *s, const struct bsdf_point *p, vec3 wo,
			 vec3 wi, spectrum (*eval)(const struct bsdf *, const struct bsdf_point *, vec3, vec3))
{
	spectrum sum = spectrum_constant(0);
	for (uint32_t k = 0; k < m->count; k++)
		sum = spectrum_add(sum, spectrum_mul(s->weight[k], eval(&m->part[k], p, wo, wi)));
	return sum;
}

static double mix_pdf(const struct blend *m, const struct part_weights *s, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	double sum = 0;
	for (uint32_t k = 0; k < m->count; k++)
		sum += s->probability[k] * m->part[k].ops->pdf_solid(&m->part[k], p, wo, wi);
	return sum;
}

/* Sums the specular lobes of all parts: those of one mode have the same direction (blend.h). */
static spectrum mix_delta(const struct blend *m, const struct part_weights *s, const struct bsdf_point *p, vec3 wo,
			  unsigned mode, vec3 *wi, double *probability)
{
	spectrum sum = spectrum_constant(0);
	double total_probability = 0;
	for (uint32_t k = 0; k < m->count; k++) {
		double part_probability;
		spectrum weight = bsdf_eval_delta(&m->part[k], p, wo, mode, wi, &part_probability);
		if (spectrum_is_zero(weight))
			continue;
		sum = spectrum_add(sum, spectrum_mul(s->weight[k], weight));
		total_probability += s->probability[k] * part_probability;
	}
	*probability = total_probability;
	return sum;
}

static spectrum part_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	return b->ops->eval(b, p, wo, wi);
}

spectrum blend_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct part_weights s;
	compute_part_weights(b->data, p, &s);
	return mix_eval(b->data, &s, p, wo, wi, part_eval);
}

spectrum blend_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct part_weights s;
	compute_part_weights(b->data, p, &s);
	return mix_eval(b->data, &s, p, wo, wi, bsdf_eval_halfvec);
}

double blend_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct part_weights s;
	compute_part_weights(b->data, p, &s);
	return mix_pdf(b->data, &s, p, wo, wi);
}

spectrum blend_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			  double *probability)
{
	struct part_weights s;
	compute_part_weights(b->data, p, &s);
	return mix_delta(b->data, &s, p, wo, mode, wi, probability);
}

bool blend_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3], struct bsdf_sample *out)
{
	const struct blend *m = b->data;
	struct part_weights s;
	uint32_t k = 0;
	double rest = u[2];
	compute_part_weights(m, p, &s);
	while (k + 1 < m->count && rest >= s.probability[k])
		rest -= s.probability[k++];
	if (!(s.probability[k] > 0))
		return false;
	const double next[3] = {u[0], u[1], fmin(rest / s.probability[k], 1 - 0x1p-53)};
	if (!m->part[k].ops->sample(&m->part[k], p, wo, next, out))
		return false;
	if (out->mode & BSDF_DELTA) {
		spectrum weight = mix_delta(m, &s, p, wo, out->mode, &out->wi, &out->pdf);
		out->f = spectrum_scale(1 / fabs(out->wi.z), weight);
	} else {
		out->pdf = mix_pdf(m, &s, p, wo, out->wi);
		out->f = mix_eval(m, &s, p, wo, out->wi, part_eval);
	}
	return out->pdf > 0;
}

int blend_merge_part(struct bsdf *b, const struct bsdf *part, const char *type, const struct scene_node *n,
		     struct error *e)
{
	if ((part->modes & BSDF_TRANSMIT) && !part->is_straight_transmitter) {
		bool differs = !b->is_straight_transmitter && b->eta != part->eta;
		if (part->is_dispersive || differs)
			return node_error(n, e, ENOTSUP, "its part \"%s\" %s", type,
					  part->is_dispersive
						  ? "is dispersive, which is not supported in a blend"
						  : "has a different index of refraction than an earlier part");
		b->eta = part->eta;
		b->is_straight_transmitter = false;
	}
	b->is_two_sided |= part->is_two_sided;
	b->has_mirrored_back |= part->has_mirrored_back;
	b->modes |= part->modes;
	b->has_smooth |= part->has_smooth;
	b->has_delta |= part->has_delta;
	b->is_textured |= part->is_textured;
	b->uses_tangents |= part->uses_tangents;
	b->is_nonreciprocal |= part->is_nonreciprocal;
	b->is_black &= part->is_black;
	if (part->has_smooth)
		b->min_alpha = fmin(b->min_alpha, part->min_alpha);
	bsdf_add_color_kind(b, part->color_kind);
	return 0;
}

struct blend *blend_begin(struct bsdf *b, uint32_t count)
{
	struct blend *m = b->data;
	b->is_black = b->is_straight_transmitter = true;
	m->count = count;
	return m;
}

int blend_read_parts(struct blend *m, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		     struct error *e)
{
	for (uint32_t k = 0; k < m->count; k++) {
		const struct scene_node *inner = node_child(n, PLUGIN_BSDF, k);
		int code = bsdf_create(&m->part[k], inner, build, e);
		if (!code)
			code = blend_merge_part(b, &m->part[k], inner->type, n, e);
		if (code)
			return code;
	}
	int rc = bsdf_share_relief(b, m->part, m->count, n, build, e);
	if (rc)
		return rc;
	if (!b->has_smooth)
		b->min_alpha = 0;
	for (uint32_t k = 0; k < m->count && b->is_two_sided; k++) {
		int code = bsdf_mirror_back(&m->part[k], build, e);
		if (code)
			return code;
	}
	return 0;
}
