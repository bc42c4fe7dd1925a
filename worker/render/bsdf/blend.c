/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/blend.h"

#include "worker/render/bsdf/tilted.h"
#include "worker/render/bsdf/twosided.h"

/* The light that each part scatters, and the probability with which a sample chooses that part. */
struct shares {
	spectrum f[BLEND_PARTS_MAX];
	double chance[BLEND_PARTS_MAX];
};

static void find_shares(const struct blend *m, const struct bsdf_point *p, struct shares *s)
{
	double sum = 0;
	if (!m->is_fixed) {
		int weighted = m->weight_of_first ? 0 : 1;
		spectrum weight = texture_eval(&m->weight, &p->where, p->w);
		s->f[weighted] = weight;
		for (int i = 0; i < SPECTRUM_LANES; i++)
			s->f[1 - weighted].v[i] = 1 - weight.v[i];
		s->chance[0] = spectrum_mean(s->f[0]);
		s->chance[1] = spectrum_mean(s->f[1]);
		return;
	}
	for (uint32_t k = 0; k < m->count; k++)
		sum += m->fixed[k];
	for (uint32_t k = 0; k < m->count; k++) {
		s->f[k] = spectrum_of(m->fixed[k]);
		s->chance[k] = m->fixed[k] / sum;
	}
}

static spectrum mix(const struct blend *m, const struct shares *s, const struct bsdf_point *p, vec3 wo, vec3 wi,
		    spectrum (*eval)(const struct bsdf *, const struct bsdf_point *, vec3, vec3))
{
	spectrum sum = spectrum_of(0);
	for (uint32_t k = 0; k < m->count; k++)
		sum = spectrum_add(sum, spectrum_mul(s->f[k], eval(&m->part[k], p, wo, wi)));
	return sum;
}

static double mix_pdf(const struct blend *m, const struct shares *s, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	double sum = 0;
	for (uint32_t k = 0; k < m->count; k++)
		sum += s->chance[k] * m->part[k].ops->pdf_solid(&m->part[k], p, wo, wi);
	return sum;
}

/* Sums the specular lobes of all parts: those of one mode have the same direction (blend.h). */
static spectrum mix_delta(const struct blend *m, const struct shares *s, const struct bsdf_point *p, vec3 wo,
			  unsigned mode, vec3 *wi, double *chance)
{
	spectrum sum = spectrum_of(0);
	double all = 0;
	for (uint32_t k = 0; k < m->count; k++) {
		double one;
		spectrum weight = bsdf_eval_delta(&m->part[k], p, wo, mode, wi, &one);
		if (spectrum_is_zero(weight))
			continue;
		sum = spectrum_add(sum, spectrum_mul(s->f[k], weight));
		all += s->chance[k] * one;
	}
	*chance = all;
	return sum;
}

static spectrum part_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	return b->ops->eval(b, p, wo, wi);
}

spectrum blend_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct shares s;
	find_shares(b->data, p, &s);
	return mix(b->data, &s, p, wo, wi, part_eval);
}

spectrum blend_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct shares s;
	find_shares(b->data, p, &s);
	return mix(b->data, &s, p, wo, wi, bsdf_eval_halfvec);
}

double blend_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct shares s;
	find_shares(b->data, p, &s);
	return mix_pdf(b->data, &s, p, wo, wi);
}

spectrum blend_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			  double *chance)
{
	struct shares s;
	find_shares(b->data, p, &s);
	return mix_delta(b->data, &s, p, wo, mode, wi, chance);
}

bool blend_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3], struct bsdf_sample *out)
{
	const struct blend *m = b->data;
	struct shares s;
	uint32_t k = 0;
	double rest = u[2];
	find_shares(m, p, &s);
	while (k + 1 < m->count && rest >= s.chance[k])
		rest -= s.chance[k++];
	if (!(s.chance[k] > 0))
		return false;
	const double next[3] = {u[0], u[1], fmin(rest / s.chance[k], 1 - 0x1p-53)};
	if (!m->part[k].ops->sample(&m->part[k], p, wo, next, out))
		return false;
	if (out->mode & BSDF_DELTA) {
		spectrum weight = mix_delta(m, &s, p, wo, out->mode, &out->wi, &out->pdf);
		out->f = spectrum_scale(1 / fabs(out->wi.z), weight);
	} else {
		out->pdf = mix_pdf(m, &s, p, wo, out->wi);
		out->f = mix(m, &s, p, wo, out->wi, part_eval);
	}
	return out->pdf > 0;
}

int blend_join(struct bsdf *b, const struct bsdf *part, const char *type, const struct scene_node *n, struct error *e)
{
	if ((part->modes & BSDF_TRANSMIT) && !part->only_straight) {
		bool other = !b->only_straight && b->eta != part->eta;
		if (part->dispersive || other)
			return node_error(n, e, ENOTSUP, "its part \"%s\" %s", type,
					  part->dispersive
						  ? "is dispersive, which is not supported in a blend"
						  : "has a different index of refraction than an earlier part");
		b->eta = part->eta;
		b->only_straight = false;
	}
	b->two_sided |= part->two_sided;
	b->mirrored |= part->mirrored;
	b->modes |= part->modes;
	b->has_smooth |= part->has_smooth;
	b->has_delta |= part->has_delta;
	b->textured |= part->textured;
	b->uses_tangents |= part->uses_tangents;
	b->directed |= part->directed;
	b->black &= part->black;
	if (part->has_smooth)
		b->alpha = fmin(b->alpha, part->alpha);
	bsdf_add_shape(b, part->shape);
	return 0;
}

struct blend *blend_begin(struct bsdf *b, uint32_t count)
{
	struct blend *m = b->data;
	b->black = b->only_straight = true;
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
			code = blend_join(b, &m->part[k], inner->type, n, e);
		if (code)
			return code;
	}
	int tilts = bsdf_share_relief(b, m->part, m->count, n, build, e);
	if (tilts)
		return tilts;
	if (!b->has_smooth)
		b->alpha = 0;
	for (uint32_t k = 0; k < m->count && b->two_sided; k++) {
		int code = bsdf_mirror_back(&m->part[k], build, e);
		if (code)
			return code;
	}
	return 0;
}
