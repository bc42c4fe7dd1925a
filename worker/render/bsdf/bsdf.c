/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/bsdf.h"

#include "worker/render/bsdf/ior.h"
#include "worker/render/bsdf/microfacet.h"

#include <string.h>

#define BSDF(name) extern const struct bsdf_ops bsdf_ops_##name;
#include "worker/render/bsdf/bsdf_list.h"
#undef BSDF

const struct bsdf_ops *const bsdf_registry[] = {
#define BSDF(name) &bsdf_ops_##name,
#include "worker/render/bsdf/bsdf_list.h"
#undef BSDF
	NULL,
};

int bsdf_create_as(struct bsdf *b, const struct bsdf_ops *ops, const struct scene_node *n,
		   const struct bsdf_build *build, struct error *e)
{
	*b = (struct bsdf){.ops = ops, .min_alpha = INFINITY, .eta = 1, .color_kind = COLOR_KIND_CONSTANT};
	if (ops->data_size > 0) {
		b->data = arena_alloc(build->arena, 1, ops->data_size);
		if (!b->data)
			return node_error(n, e, ENOMEM, "out of memory");
	}
	return ops->create(b, n, build, e);
}

int bsdf_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	for (const struct bsdf_ops *const *ops = bsdf_registry; *ops; ops++)
		if (strcmp((*ops)->decl.type, n->type) == 0)
			return bsdf_create_as(b, *ops, n, build, e);
	return node_error(n, e, ENOTSUP, "\"%s\" is not a supported BSDF", n->type);
}

double bsdf_eta(const struct bsdf *b, const struct wavelengths *w)
{
	return b->is_dispersive && b->ior ? ior_eta(b->ior, w->nm[0]) : b->eta;
}

/* Computes the product of bsdf_eval_halfvec from `eval`, with nothing cancelled, for plug-ins without eval_halfvec. */
static spectrum eval_halfvec_product(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct bsdf_point radiance = *p;
	radiance.transport = TRANSPORT_RADIANCE;
	spectrum f = b->ops->eval(b, &radiance, wo, wi);
	bool reflect = wo.z * wi.z > 0;
	double eta = reflect ? 1 : wo.z > 0 ? bsdf_eta(b, p->wavelengths) : 1 / bsdf_eta(b, p->wavelengths), length;
	vec3 h;
	if (!reflect && eta == 1)
		return f; /* d wi / d h is 1 / |wi.z| */
	if (spectrum_is_zero(f) || !microfacet_half_vector(wo, eta, wi, &h, &length))
		return spectrum_constant(0);
	double ih = vec3_dot(wi, h), solid = reflect ? 2 * length : length * length / (eta * eta * fabs(ih));
	return spectrum_scale(fabs(wi.z * h.z * h.z * h.z) * solid, f);
}

spectrum bsdf_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	return b->ops->eval_halfvec ? b->ops->eval_halfvec(b, p, wo, wi) : eval_halfvec_product(b, p, wo, wi);
}

/* Straight and refracted transmission leave on the same side of the surface: a query for the one must not be answered
 * with the other. */
static bool may_have_delta(const struct bsdf *b, unsigned mode)
{
	if (mode & BSDF_STRAIGHT)
		return b->modes & BSDF_STRAIGHT;
	return !(mode & BSDF_TRANSMIT) || !b->is_straight_transmitter;
}

spectrum bsdf_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			 double *probability)
{
	if (!b->ops->eval_delta || !may_have_delta(b, mode))
		return spectrum_constant(0);
	return b->ops->eval_delta(b, p, wo, mode, wi, probability);
}

spectrum bsdf_eval_zero(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return spectrum_constant(0);
}

double bsdf_pdf_zero(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return 0;
}

static bool black_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			 struct bsdf_sample *out)
{
	(void)b, (void)p, (void)wo, (void)u, (void)out;
	return false;
}

void bsdf_make_black(struct bsdf *b)
{
	static const struct bsdf_ops ops = {
		.decl.type = "black", .eval = bsdf_eval_zero, .pdf_solid = bsdf_pdf_zero, .sample = black_sample};
	*b = (struct bsdf){
		.ops = &ops, .min_alpha = INFINITY, .eta = 1, .is_black = true, .color_kind = COLOR_KIND_CONSTANT};
}
