/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/create.h"

#include "worker/render/texture/attribute_table.h"

int bsdf_wrap(struct bsdf *b, const struct bsdf_ops *ops, const struct scene_node *n, const struct bsdf_build *build,
	      struct error *e)
{
	struct bsdf *inner = arena_alloc(build->arena, 1, sizeof *inner);
	if (!inner)
		return node_error(n, e, ENOMEM, "out of memory");
	*inner = *b;
	b->ops = ops;
	b->data = inner;
	return 0;
}

bool bsdf_sample_smooth(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi, struct bsdf_sample *out)
{
	double pdf = b->ops->pdf_solid(b, p, wo, wi);
	if (!(pdf > 0))
		return false;
	*out = (struct bsdf_sample){.wi = wi,
				    .mode = (wo.z > 0) == (wi.z > 0) ? BSDF_REFLECT : BSDF_TRANSMIT,
				    .pdf = pdf,
				    .f = b->ops->eval(b, p, wo, wi),
				    .eta = 1};
	return true;
}

bool bsdf_sample_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode,
		       struct bsdf_sample *out)
{
	*out = (struct bsdf_sample){.mode = mode | BSDF_DELTA, .eta = 1};
	spectrum weight = b->ops->eval_delta(b, p, wo, mode, &out->wi, &out->pdf);
	if (!(out->pdf > 0))
		return false;
	out->f = spectrum_scale(1 / fabs(out->wi.z), weight);
	return true;
}

void bsdf_make_smooth(struct bsdf *b, const struct bsdf_ops *ops)
{
	b->ops = ops;
	b->modes |= BSDF_DELTA;
	b->has_smooth = false;
	b->has_delta = true;
	b->alpha = b->alpha_mean = 0;
}

int bsdf_check_energy(const struct scene_node *n, double sum, struct error *e)
{
	if (!(sum > 1) || node_bool(n, "ensure_energy_conservation", true))
		return 0;
	return node_error(
		n, e, ERANGE,
		"it would reflect %g times the light that it receives (ensureEnergyConservation is false), which "
		"is not supported",
		sum);
}

void bsdf_add_shape(struct bsdf *b, enum color_shape shape)
{
	if (shape != COLOR_SHAPE_CONSTANT)
		b->shape = COLOR_SHAPE_OTHER;
}

static int read_texture(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name,
			double fallback, enum color_role role, const struct texture_build *build, struct error *e)
{
	int code = texture_from_node(t, n, name, fallback, role, build, e);
	if (code)
		return code;
	bsdf_add_shape(b, texture_shape(t));
	b->textured |= !texture_is_constant(t);
	return 0;
}

int bsdf_texture(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		 const struct bsdf_build *build, struct error *e)
{
	const struct texture_build inner = bsdf_texture_build(build);
	return read_texture(b, t, n, name, fallback, COLOR_REFLECTANCE, &inner, e);
}

int bsdf_number(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		const struct bsdf_build *build, struct error *e)
{
	struct texture_build inner = bsdf_texture_build(build);
	inner.number = true;
	return read_texture(b, t, n, name, fallback, COLOR_REFLECTANCE, &inner, e);
}

int bsdf_quantity(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		  bool number, const struct bsdf_build *build, struct error *e)
{
	struct texture_build inner = bsdf_texture_build(build);
	inner.number = number;
	return read_texture(b, t, n, name, fallback, COLOR_UNBOUNDED, &inner, e);
}

enum { PROBE_SIDE = 64 };

struct bsdf_probes bsdf_probes_of(const struct bsdf_build *build)
{
	const struct attribute_table *t = build->attributes;
	struct bsdf_probes p = {PROBE_SIDE * PROBE_SIDE, t, t ? (uint64_t)t->asked * t->triangle_count : 0};
	if (p.points > p.count)
		p.count = p.points < BSDF_PROBES_MAX ? (uint32_t)p.points : BSDF_PROBES_MAX;
	return p;
}

/* The point at equal distances from all three edges: its barycentric coordinates are proportional to the lengths of the
 * opposite edges. */
static void put_middle(const struct attribute_table *t, struct texture_point *at)
{
	vec3 side[3];
	attribute_table_sides(t, at->prim, side);
	double all = vec3_length(side[0]) + vec3_length(side[1]) + vec3_length(side[2]);
	at->b1 = vec3_length(side[1]) / all;
	at->b2 = vec3_length(side[2]) / all;
}

struct bsdf_point bsdf_probe(const struct bsdf_probes *p, uint32_t i)
{
	static const struct wavelengths w = {.nm = {450, 500, 550, 600}};
	uint32_t row = i / PROBE_SIDE % PROBE_SIDE, column = i % PROBE_SIDE;
	struct bsdf_point at = {
		.where = {.u = (row + 0.5) / PROBE_SIDE, .v = (column + 0.5) / PROBE_SIDE, .probe = true}, .w = &w};
	if (p->points > 0) {
		uint64_t point = p->points > p->count ? i * p->points / p->count : i % p->points;
		unsigned which = (unsigned)(point % p->mesh->asked);
		at.where.prim = (uint32_t)(point / p->mesh->asked);
		at.where.b1 = which == 1;
		at.where.b2 = which == 2;
		if (which == ASKED_ATTRIBUTES)
			put_middle(p->mesh, &at.where);
	}
	return at;
}

struct bsdf_range bsdf_probe_range(const struct texture *t, const struct bsdf_build *build)
{
	const struct bsdf_probes probes = bsdf_probes_of(build);
	struct bsdf_range r = {INFINITY, -INFINITY};
	uint32_t count = texture_is_constant(t) ? 1 : probes.count;
	for (uint32_t i = 0; i < count; i++) {
		const struct bsdf_point at = bsdf_probe(&probes, i);
		double x = spectrum_mean(texture_eval(t, &at.where, at.w));
		r.least = fmin(r.least, x);
		r.most = fmax(r.most, x);
	}
	return r;
}
