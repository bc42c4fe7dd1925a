/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/lobe_filter.h"

struct lobe_filter {
	struct bsdf inner;
	unsigned lobes;
};

static bool is_removed(const struct lobe_filter *x, bool transmit, bool delta)
{
	return (transmit && (x->lobes & BSDF_WITHOUT_TRANSMISSION)) ||
	       (x->lobes & (delta ? BSDF_WITHOUT_DELTA : BSDF_WITHOUT_SMOOTH));
}

static spectrum lobe_filter_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct lobe_filter *x = b->data;
	return is_removed(x, wo.z * wi.z < 0, false) ? spectrum_constant(0) : x->inner.ops->eval(&x->inner, p, wo, wi);
}

static double lobe_filter_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct lobe_filter *x = b->data;
	return is_removed(x, wo.z * wi.z < 0, false) ? 0 : x->inner.ops->pdf_solid(&x->inner, p, wo, wi);
}

static spectrum lobe_filter_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	const struct lobe_filter *x = b->data;
	return is_removed(x, wo.z * wi.z < 0, false) ? spectrum_constant(0) : bsdf_eval_halfvec(&x->inner, p, wo, wi);
}

static spectrum lobe_filter_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode,
				       vec3 *wi, double *probability)
{
	const struct lobe_filter *x = b->data;
	return is_removed(x, mode & BSDF_TRANSMIT, true) ? spectrum_constant(0)
							 : bsdf_eval_delta(&x->inner, p, wo, mode, wi, probability);
}

static bool lobe_filter_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			       struct bsdf_sample *out)
{
	const struct lobe_filter *x = b->data;
	return x->inner.ops->sample(&x->inner, p, wo, u, out) &&
	       !is_removed(x, out->mode & BSDF_TRANSMIT, out->mode & BSDF_DELTA);
}

int bsdf_filter_lobes(struct bsdf *b, unsigned lobes, struct arena *arena, struct error *e)
{
	static const struct bsdf_ops ops = {
		.decl.type = "lobe_filter",
		.eval = lobe_filter_eval,
		.pdf_solid = lobe_filter_pdf,
		.eval_halfvec = lobe_filter_eval_halfvec,
		.eval_delta = lobe_filter_eval_delta,
		.sample = lobe_filter_sample,
	};
	struct lobe_filter *x = arena_alloc(arena, 1, sizeof *x);
	if (!x)
		return error_set(e, ENOMEM, "out of memory");
	*x = (struct lobe_filter){.inner = *b, .lobes = lobes};
	b->ops = &ops;
	b->data = x;
	if (lobes & BSDF_WITHOUT_TRANSMISSION)
		b->modes &= ~(unsigned)(BSDF_TRANSMIT | BSDF_STRAIGHT);
	if (lobes & BSDF_WITHOUT_DELTA) {
		b->modes &= ~(unsigned)(BSDF_DELTA | BSDF_STRAIGHT);
		b->has_delta = false;
	}
	if (lobes & BSDF_WITHOUT_SMOOTH)
		b->has_smooth = false;
	if (!b->has_smooth)
		b->min_alpha = b->mean_alpha = 0;
	if (!b->has_smooth && !b->has_delta) {
		bsdf_make_black(b);
		b->min_alpha = INFINITY;
	}
	return 0;
}
