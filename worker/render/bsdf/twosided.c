/* SPDX-License-Identifier: Apache-2.0 */
/* One or two opaque BSDFs: the first on the side of the normal, the second (or the first again) on the other side. */
#include "worker/render/bsdf/twosided.h"
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/tilted.h"

extern const struct bsdf_ops bsdf_ops_twosided;

struct twosided {
	struct bsdf side[2]; /* front, back */
};

static vec3 mirror(vec3 v)
{
	return (vec3){v.x, v.y, -v.z};
}

/* Returns a shading frame in coordinates mirrored at the surface. */
static struct frame mirrored_frame(const void *front, const struct relief *r)
{
	const struct relief_frames *relief_frames = front;
	struct frame f = relief_frames->get_frame(relief_frames->context, r);
	return (struct frame){mirror(f.s), mirror(f.t), vec3_neg(mirror(f.n))};
}

/* Returns the point for the BSDF of the back, which sees everything mirrored: p itself, or q if frames have to be
 * mirrored; q must outlive the result. */
static const struct bsdf_point *back_point(const struct bsdf *b, const struct bsdf_point *p, struct bsdf_point *q)
{
	if (!b->uses_relief_frames || !p->relief_frames.get_frame)
		return p;
	*q = *p;
	q->relief_frames = (struct relief_frames){&p->relief_frames, mirrored_frame};
	return q;
}

static spectrum twosided_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct twosided *t = b->data;
	if (wo.z > 0)
		return t->side[0].ops->eval(&t->side[0], p, wo, wi);
	struct bsdf_point q;
	return t->side[1].ops->eval(&t->side[1], back_point(b, p, &q), mirror(wo), mirror(wi));
}

static double twosided_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct twosided *t = b->data;
	if (wo.z > 0)
		return t->side[0].ops->pdf_solid(&t->side[0], p, wo, wi);
	struct bsdf_point q;
	return t->side[1].ops->pdf_solid(&t->side[1], back_point(b, p, &q), mirror(wo), mirror(wi));
}

static spectrum twosided_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct twosided *t = b->data;
	if (wo.z > 0)
		return bsdf_eval_halfvec(&t->side[0], p, wo, wi);
	struct bsdf_point q;
	return bsdf_eval_halfvec(&t->side[1], back_point(b, p, &q), mirror(wo), mirror(wi));
}

static spectrum twosided_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				    double *probability)
{
	const struct twosided *t = b->data;
	if (wo.z > 0)
		return bsdf_eval_delta(&t->side[0], p, wo, mode, wi, probability);
	struct bsdf_point q;
	spectrum weight = bsdf_eval_delta(&t->side[1], back_point(b, p, &q), mirror(wo), mode, wi, probability);
	if (!spectrum_is_zero(weight))
		*wi = mirror(*wi);
	return weight;
}

static bool twosided_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			    struct bsdf_sample *out)
{
	const struct twosided *t = b->data;
	if (wo.z > 0)
		return t->side[0].ops->sample(&t->side[0], p, wo, u, out);
	struct bsdf_point q;
	if (!t->side[1].ops->sample(&t->side[1], back_point(b, p, &q), mirror(wo), u, out))
		return false;
	out->wi = mirror(out->wi);
	return true;
}

int bsdf_mirror_back(struct bsdf *b, const struct bsdf_build *build, struct error *e)
{
	if (build->has_black_backs || b->is_two_sided || (b->modes & BSDF_TRANSMIT) || !b->modes)
		return 0;
	struct twosided *t = arena_alloc(build->arena, 1, sizeof *t);
	if (!t)
		return error_set(e, ENOMEM, "out of memory");
	t->side[0] = t->side[1] = *b;
	b->data = t;
	b->ops = &bsdf_ops_twosided;
	b->is_two_sided = b->has_mirrored_back = true;
	return 0;
}

static int twosided_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct twosided *t = b->data;
	if (!node_child(n, PLUGIN_BSDF, 0) || node_child(n, PLUGIN_BSDF, 2))
		return node_error(n, e, EINVAL, "twosided takes one or two nested BSDFs");
	for (uint32_t i = 0; i < 2; i++) {
		const struct scene_node *inner = node_child(n, PLUGIN_BSDF, i);
		if (!inner) {
			t->side[i] = t->side[0];
			continue;
		}
		int code = bsdf_create(&t->side[i], inner, build, e);
		if (code)
			return code;
		/* An opaque BSDF that is already two-sided shows its front on both sides. */
		if (t->side[i].modes & BSDF_TRANSMIT)
			return node_error(inner, e, EINVAL,
					  "\"%s\" transmits light; twosided only accepts opaque BSDFs", inner->type);
	}
	int rc = bsdf_share_relief(b, t->side, 2, n, build, e);
	if (rc)
		return rc;
	b->is_two_sided = true;
	b->is_black = t->side[0].is_black && t->side[1].is_black;
	b->min_alpha = fmin(t->side[0].has_smooth ? t->side[0].min_alpha : INFINITY,
			    t->side[1].has_smooth ? t->side[1].min_alpha : INFINITY);
	for (int i = 0; i < 2; i++) {
		b->modes |= t->side[i].modes;
		b->has_smooth |= t->side[i].has_smooth;
		b->has_delta |= t->side[i].has_delta;
		b->is_textured |= t->side[i].is_textured;
		b->uses_tangents |= t->side[i].uses_tangents;
		b->is_nonreciprocal |= t->side[i].is_nonreciprocal;
		bsdf_add_color_kind(b, t->side[i].color_kind);
	}
	if (!b->has_smooth)
		b->min_alpha = 0;
	/* The side from which light arrives is not known: both sides count the same. */
	int smooth = t->side[0].has_smooth + t->side[1].has_smooth;
	b->mean_alpha = smooth ? (t->side[0].mean_alpha + t->side[1].mean_alpha) / smooth : 0;
	return 0;
}

const struct bsdf_ops bsdf_ops_twosided = {
	.decl = {PLUGIN_BSDF, "twosided", NULL, 1u << PLUGIN_BSDF, PARAM_UNDERSTOOD},
	.data_size = sizeof(struct twosided),
	.create = twosided_create,
	.eval = twosided_eval,
	.pdf_solid = twosided_pdf,
	.eval_halfvec = twosided_eval_halfvec,
	.eval_delta = twosided_eval_delta,
	.sample = twosided_sample,
};
