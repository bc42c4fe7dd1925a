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

void bsdf_make_specular(struct bsdf *b, const struct bsdf_ops *ops)
{
	b->ops = ops;
	b->modes |= BSDF_DELTA;
	b->has_smooth = false;
	b->has_delta = true;
	b->min_alpha = b->mean_alpha = 0;
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

void bsdf_add_color_kind(struct bsdf *b, enum color_kind kind)
{
	if (kind != COLOR_KIND_CONSTANT)
		b->color_kind = COLOR_KIND_OTHER;
}

static int read_texture(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name,
			double fallback, enum color_role role, const struct texture_build *build, struct error *e)
{
	int code = texture_from_node(t, n, name, fallback, role, build, e);
	if (code)
		return code;
	bsdf_add_color_kind(b, texture_color_kind(t));
	b->is_textured |= !texture_is_constant(t);
	return 0;
}

int bsdf_read_texture(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		      const struct bsdf_build *build, struct error *e)
{
	const struct texture_build texture_build = bsdf_texture_build(build);
	return read_texture(b, t, n, name, fallback, COLOR_REFLECTANCE, &texture_build, e);
}

int bsdf_read_number(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		     const struct bsdf_build *build, struct error *e)
{
	struct texture_build texture_build = bsdf_texture_build(build);
	texture_build.is_number = true;
	return read_texture(b, t, n, name, fallback, COLOR_REFLECTANCE, &texture_build, e);
}

int bsdf_read_quantity(struct bsdf *b, struct texture *t, const struct scene_node *n, const char *name, double fallback,
		       bool is_number, const struct bsdf_build *build, struct error *e)
{
	struct texture_build texture_build = bsdf_texture_build(build);
	texture_build.is_number = is_number;
	return read_texture(b, t, n, name, fallback, COLOR_UNBOUNDED, &texture_build, e);
}

enum { PROBE_SIDE = 64 };

struct bsdf_probes bsdf_probes_make(const struct bsdf_build *build)
{
	const struct attribute_table *t = build->attributes;
	struct bsdf_probes p = {PROBE_SIDE * PROBE_SIDE, t,
				t ? (uint64_t)t->probes_per_triangle * t->triangle_count : 0};
	if (p.mesh_point_count > p.count)
		p.count = p.mesh_point_count < BSDF_PROBES_MAX ? (uint32_t)p.mesh_point_count : BSDF_PROBES_MAX;
	return p;
}

/* The point at equal distances from all three edges: its barycentric coordinates are proportional to the lengths of the
 * opposite edges. */
static void set_equidistant_point(const struct attribute_table *t, struct texture_point *point)
{
	vec3 side[3];
	attribute_table_edges(t, point->prim, side);
	double perimeter = vec3_length(side[0]) + vec3_length(side[1]) + vec3_length(side[2]);
	point->b1 = vec3_length(side[1]) / perimeter;
	point->b2 = vec3_length(side[2]) / perimeter;
}

struct bsdf_point bsdf_probe_point(const struct bsdf_probes *p, uint32_t i)
{
	static const struct wavelengths w = {.nm = {450, 500, 550, 600}};
	uint32_t row = i / PROBE_SIDE % PROBE_SIDE, column = i % PROBE_SIDE;
	struct bsdf_point probe = {
		.texture_point = {.u = (row + 0.5) / PROBE_SIDE, .v = (column + 0.5) / PROBE_SIDE, .is_probe = true},
		.wavelengths = &w};
	if (p->mesh_point_count > 0) {
		uint64_t mesh_point =
			p->mesh_point_count > p->count ? i * p->mesh_point_count / p->count : i % p->mesh_point_count;
		unsigned corner = (unsigned)(mesh_point % p->mesh->probes_per_triangle);
		probe.texture_point.prim = (uint32_t)(mesh_point / p->mesh->probes_per_triangle);
		probe.texture_point.b1 = corner == 1;
		probe.texture_point.b2 = corner == 2;
		if (corner == TRIANGLE_PROBES_CORNERS)
			set_equidistant_point(p->mesh, &probe.texture_point);
	}
	return probe;
}

struct bsdf_range bsdf_probe_range(const struct texture *t, const struct bsdf_build *build)
{
	const struct bsdf_probes probes = bsdf_probes_make(build);
	struct bsdf_range range = {INFINITY, -INFINITY};
	uint32_t count = texture_is_constant(t) ? 1 : probes.count;
	for (uint32_t i = 0; i < count; i++) {
		const struct bsdf_point probe = bsdf_probe_point(&probes, i);
		double x = spectrum_mean(texture_eval(t, &probe.texture_point, probe.wavelengths));
		range.min = fmin(range.min, x);
		range.max = fmax(range.max, x);
	}
	return range;
}
