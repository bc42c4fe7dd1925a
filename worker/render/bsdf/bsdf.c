/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/bsdf.h"

#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/glass.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/texture/attribute_table.h"

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

int bsdf_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	for (const struct bsdf_ops *const *ops = bsdf_registry; *ops; ops++)
		if (strcmp((*ops)->type, n->type) == 0) {
			*b = (struct bsdf){.ops = *ops, .alpha = INFINITY, .eta = 1, .shape = COLOR_SHAPE_CONSTANT};
			return (*ops)->create(b, n, build, e);
		}
	return node_error(n, e, ENOTSUP, "\"%s\" is no BSDF that is supported", n->type);
}

void *bsdf_data(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, size_t size,
		struct error *e)
{
	b->data = arena_alloc(build->arena, 1, size);
	if (!b->data)
		node_error(n, e, ENOMEM, "out of memory");
	return b->data;
}

void bsdf_make_smooth(struct bsdf *b, const struct bsdf_ops *ops)
{
	b->ops = ops;
	b->modes |= BSDF_DELTA;
	b->has_smooth = false;
	b->has_delta = true;
	b->alpha = b->alpha_mean = 0;
}

int bsdf_take_relief(struct bsdf *b, const struct bsdf *part, bool first, const struct scene_node *n, struct error *e)
{
	if (!first && part->relief != b->relief)
		return node_error(
			n, e, ENOTSUP,
			"its two BSDFs bend the surface differently; one bump or normal map around both is supported");
	b->relief = part->relief;
	return 0;
}

int bsdf_check_energy(const struct scene_node *n, double sum, struct error *e)
{
	if (!(sum > 1) || node_bool(n, "ensure_energy_conservation", true))
		return 0;
	return node_error(n, e, ERANGE,
			  "it would give back %g times the light that it gets (ensureEnergyConservation is false), "
			  "which is not supported",
			  sum);
}

void bsdf_add_shape(struct bsdf *b, enum color_shape shape)
{
	if (shape != COLOR_SHAPE_CONSTANT)
		b->shape = COLOR_SHAPE_OTHER;
}

int bsdf_texture(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		 const struct bsdf_build *build, struct error *e)
{
	const struct texture_build inner = bsdf_texture_build(build);
	int code = texture_from_node(t, n, name, fallback, COLOR_REFLECTANCE, &inner, e);
	if (code)
		return code;
	bsdf_add_shape(b, texture_shape(t));
	b->textured |= !texture_is_constant(t);
	return 0;
}

enum { PROBE_SIDE = 64 };

struct bsdf_probes bsdf_probes_of(const struct bsdf_build *build)
{
	const struct attribute_table *t = build->attributes;
	struct bsdf_probes p = {PROBE_SIDE * PROBE_SIDE, t && t->asked ? 3 * (uint64_t)t->triangle_count : 0};
	if (p.corners > p.count)
		p.count = p.corners < BSDF_PROBES_MAX ? (uint32_t)p.corners : BSDF_PROBES_MAX;
	return p;
}

struct bsdf_point bsdf_probe(const struct bsdf_probes *p, uint32_t i)
{
	static const struct wavelengths w = {.nm = {450, 500, 550, 600}};
	uint32_t row = i / PROBE_SIDE % PROBE_SIDE, column = i % PROBE_SIDE;
	struct bsdf_point at = {.where = {.u = (row + 0.5) / PROBE_SIDE, .v = (column + 0.5) / PROBE_SIDE}, .w = &w};
	if (p->corners > 0) {
		uint64_t corner = p->corners > p->count ? i * p->corners / p->count : i % p->corners;
		at.where.prim = (uint32_t)(corner / 3);
		at.where.b1 = corner % 3 == 1;
		at.where.b2 = corner % 3 == 2;
	}
	return at;
}

double bsdf_eta(const struct bsdf *b, const struct wavelengths *w)
{
	return b->dispersive ? glass_eta(b->data, w->nm[0]) : b->eta;
}

/* What a plug-in that cancels nothing by hand is worth. */
static spectrum halfvec_product(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	struct bsdf_point radiance = *p;
	radiance.transport = TRANSPORT_RADIANCE;
	spectrum f = b->ops->eval(b, &radiance, wo, wi);
	bool reflect = wo.z * wi.z > 0;
	double eta = reflect ? 1 : wo.z > 0 ? bsdf_eta(b, p->w) : 1 / bsdf_eta(b, p->w), length;
	vec3 h;
	if (!reflect && eta == 1)
		return f; /* d wi / d h is 1 / |wi.z| */
	if (spectrum_is_zero(f) || !microfacet_half(wo, eta, wi, &h, &length))
		return spectrum_of(0);
	double ih = vec3_dot(wi, h), solid = reflect ? 2 * length : length * length / (eta * eta * fabs(ih));
	return spectrum_scale(fabs(wi.z * h.z * h.z * h.z) * solid, f);
}

spectrum bsdf_eval_halfvec(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	return b->ops->eval_halfvec ? b->ops->eval_halfvec(b, p, wo, wi) : halfvec_product(b, p, wo, wi);
}

spectrum bsdf_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
			 double *chance)
{
	return b->ops->eval_delta ? b->ops->eval_delta(b, p, wo, mode, wi, chance) : spectrum_of(0);
}

static spectrum black_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return spectrum_of(0);
}

static double black_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
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

void bsdf_black(struct bsdf *b)
{
	static const struct bsdf_ops ops = {
		.type = "black", .eval = black_eval, .pdf_solid = black_pdf, .sample = black_sample};
	*b = (struct bsdf){.ops = &ops, .alpha = INFINITY, .eta = 1, .black = true, .shape = COLOR_SHAPE_CONSTANT};
}
