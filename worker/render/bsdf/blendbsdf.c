/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Several BSDFs, each with a share of the light: `blendbsdf` two by a weight (0 is the first, 1 the second),
 * `mixturebsdf` any number by fixed weights; what these leave of 1 is absorbed, and they are scaled if they exceed it.
 *
 * A surface has one index of refraction, and specular lobes of the same kind must have the same direction: transmitting
 * parts must have the same index, and none may be dispersive.
 */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/twosided.h"
#include "worker/render/scene/number.h"

enum { PARTS_MAX = 16 };

struct blend {
	uint32_t count;
	struct bsdf *part;
	struct texture weight;	 /* of the second; blendbsdf */
	double fixed[PARTS_MAX]; /* mixturebsdf */
	bool is_fixed;
};

/* For each part: its share of the light, and the probability of choosing it. */
struct shares {
	spectrum f[PARTS_MAX];
	double chance[PARTS_MAX];
};

static void find_shares(const struct blend *m, const struct bsdf_point *p, struct shares *s)
{
	double sum = 0;
	if (!m->is_fixed) {
		s->f[1] = texture_eval(&m->weight, &p->where, p->w);
		for (int i = 0; i < SPECTRUM_LANES; i++)
			s->f[0].v[i] = 1 - s->f[1].v[i];
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

static spectrum mix(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi,
		    spectrum (*eval)(const struct bsdf *, const struct bsdf_point *, vec3, vec3))
{
	const struct blend *m = b->data;
	struct shares s;
	spectrum sum = spectrum_of(0);
	find_shares(m, p, &s);
	for (uint32_t k = 0; k < m->count; k++)
		sum = spectrum_add(sum, spectrum_mul(s.f[k], eval(&m->part[k], p, wo, wi)));
	return sum;
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
	struct shares s;
	double sum = 0;
	find_shares(m, p, &s);
	for (uint32_t k = 0; k < m->count; k++)
		sum += s.chance[k] * m->part[k].ops->pdf_solid(&m->part[k], p, wo, wi);
	return sum;
}

/* Specular lobes of all parts have the same direction. */
static spectrum blend_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				 double *chance)
{
	const struct blend *m = b->data;
	struct shares s;
	spectrum sum = spectrum_of(0);
	double all = 0;
	find_shares(m, p, &s);
	for (uint32_t k = 0; k < m->count; k++) {
		double one;
		spectrum weight = bsdf_eval_delta(&m->part[k], p, wo, mode, wi, &one);
		if (spectrum_is_zero(weight))
			continue;
		sum = spectrum_add(sum, spectrum_mul(s.f[k], weight));
		all += s.chance[k] * one;
	}
	*chance = all;
	return sum;
}

static bool blend_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			 struct bsdf_sample *out)
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
		spectrum weight = blend_eval_delta(b, p, wo, out->mode, &out->wi, &out->pdf);
		out->f = spectrum_scale(1 / fabs(out->wi.z), weight);
	} else {
		out->pdf = blend_pdf(b, p, wo, out->wi);
		out->f = blend_eval(b, p, wo, out->wi);
	}
	return out->pdf > 0;
}

/* Whether this part is compatible with those before it; merges its properties into b. */
static int join(struct bsdf *b, const struct bsdf *part, bool first, const struct scene_node *n,
		const struct scene_node *inner, struct error *e)
{
	if (part->modes & BSDF_TRANSMIT) {
		bool other = (b->modes & BSDF_TRANSMIT) && b->eta != part->eta;
		if (part->dispersive || other)
			return node_error(n, e, ENOTSUP, "its part \"%s\" %s", inner->type,
					  part->dispersive
						  ? "is dispersive, which parts of a blend may not be"
						  : "has a different index of refraction than an earlier part");
		b->eta = part->eta;
	}
	int code = bsdf_take_relief(b, part, first, n, e);
	if (code)
		return code;
	b->two_sided |= part->two_sided;
	b->modes |= part->modes;
	b->has_smooth |= part->has_smooth;
	b->has_delta |= part->has_delta;
	b->textured |= part->textured;
	b->black &= part->black;
	if (part->has_smooth)
		b->alpha = fmin(b->alpha, part->alpha);
	bsdf_add_shape(b, part->shape);
	return 0;
}

static int read_parts(struct blend *m, struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
		      struct error *e)
{
	m->part = arena_alloc(build->arena, m->count, sizeof *m->part);
	if (!m->part)
		return node_error(n, e, ENOMEM, "out of memory");
	b->black = true;
	for (uint32_t k = 0; k < m->count; k++) {
		const struct scene_node *inner = node_child(n, PLUGIN_BSDF, k);
		int code = bsdf_create(&m->part[k], inner, build, e);
		if (!code)
			code = join(b, &m->part[k], k == 0, n, inner, e);
		if (code)
			return code;
	}
	if (!b->has_smooth)
		b->alpha = 0;
	for (uint32_t k = 0; k < m->count && b->two_sided; k++) {
		int code = bsdf_mirror_back(&m->part[k], build, e);
		if (code)
			return code;
	}
	return 0;
}

static int blend_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct blend *m = bsdf_data(b, n, build, sizeof *m, e);
	if (!m)
		return -ENOMEM;
	if (!node_child(n, PLUGIN_BSDF, 1) || node_child(n, PLUGIN_BSDF, 2))
		return node_error(n, e, EINVAL, "needs exactly two BSDFs inside");
	m->count = 2;
	int code = read_parts(m, b, n, build, e);
	if (code)
		return code;
	b->alpha_mean = 0.5 * m->part[0].alpha_mean + 0.5 * m->part[1].alpha_mean;
	return bsdf_texture(b, &m->weight, n, "weight", 0.5, build, e);
}

/* As many weights as parts. */
static int read_weights(struct blend *m, const struct scene_node *n, struct error *e)
{
	const char *text = node_string(n, "weights", "");
	double sum = 0;
	if (number_list(text, m->fixed, PARTS_MAX) != (int)m->count)
		return node_error(n, e, EINVAL, "weights=\"%s\": needs %u weights, one for each BSDF", text, m->count);
	for (uint32_t k = 0; k < m->count; k++) {
		if (!(m->fixed[k] >= 0 && m->fixed[k] <= 1e6))
			return node_error(n, e, ERANGE, "weights=\"%s\": must be within [0, 1e6]", text);
		sum += m->fixed[k];
	}
	if (!(sum > 0))
		return node_error(n, e, EINVAL, "weights=\"%s\": all are 0", text);
	for (uint32_t k = 0; k < m->count && sum > 1; k++)
		m->fixed[k] /= sum;
	return bsdf_check_energy(n, sum, e);
}

static int mixture_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct blend *m = bsdf_data(b, n, build, sizeof *m, e);
	if (!m)
		return -ENOMEM;
	m->is_fixed = true;
	while (node_child(n, PLUGIN_BSDF, m->count))
		if (m->count++ == PARTS_MAX)
			return node_error(n, e, ERANGE, "more than %d BSDFs inside", PARTS_MAX);
	if (m->count == 0)
		return node_error(n, e, EINVAL, "needs BSDFs inside");
	int code = read_weights(m, n, e);
	if (!code)
		code = read_parts(m, b, n, build, e);
	double sum = 0;
	for (uint32_t k = 0; k < m->count && !code; k++)
		sum += m->fixed[k];
	b->alpha_mean = 0;
	for (uint32_t k = 0; k < m->count && !code; k++)
		b->alpha_mean += m->fixed[k] / sum * m->part[k].alpha_mean;
	return code;
}

static const struct param blend_params[] = {{.name = "weight", .types = VALUE_TEXTURE, .min = 0, .max = 1},
					    {.name = NULL}};
static const struct param mixture_params[] = {
	{.name = "weights", .types = VALUE_STRING},
	BSDF_ENERGY_PARAM,
	{.name = NULL},
};

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

const struct bsdf_ops bsdf_ops_mixturebsdf = {
	.type = "mixturebsdf",
	.params = mixture_params,
	.nested_classes = 1 << PLUGIN_BSDF,
	.create = mixture_create,
	.eval = blend_eval,
	.pdf_solid = blend_pdf,
	.eval_halfvec = blend_eval_halfvec,
	.eval_delta = blend_eval_delta,
	.sample = blend_sample,
};
