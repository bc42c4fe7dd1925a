/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/rough_boundary.h"

#include "worker/render/bsdf/fresnel.h"

enum { NORMALS_PER_SIDE = 16, STEPS = 1024 };

/* Returns the share of light at an angle that the boundary reflects to the same side: the integral over visible
 * normals, by the midpoint rule. */
static double boundary_reflectance(const struct microfacet *m, double eta, double cosine)
{
	double sum = 0;
	vec3 v = {sqrt((1 - cosine) * (1 + cosine)), 0, cosine};
	for (int i = 0; i < NORMALS_PER_SIDE * NORMALS_PER_SIDE; i++) {
		vec3 h = microfacet_sample_visible(m, v, (i / NORMALS_PER_SIDE + 0.5) / NORMALS_PER_SIDE,
						   (i % NORMALS_PER_SIDE + 0.5) / NORMALS_PER_SIDE);
		double c = fmin(vec3_dot(v, h), 1);
		vec3 w = vec3_sub(vec3_scale(2 * c, h), v);
		if (c > 0 && w.z > 0)
			sum += fresnel_dielectric(c, eta).reflectance *
			       fmin(microfacet_g1_over_cos(m, vec3_normalize(w)) * w.z, 1);
	}
	return sum / (NORMALS_PER_SIDE * NORMALS_PER_SIDE);
}

static double node_cosine(int i)
{
	double x = fmax((double)i / (BOUNDARY_NODES - 1), 1e-3);
	return x * x;
}

static double interpolate_row(const double row[BOUNDARY_NODES], double cosine)
{
	double x = sqrt(fmin(cosine, 1)) * (BOUNDARY_NODES - 1);
	int i = x < BOUNDARY_NODES - 2 ? (int)x : BOUNDARY_NODES - 2;
	double t = x - i;
	return (1 - t) * row[i] + t * row[i + 1];
}

static void tabulate_row(const struct boundary_table *t, int row)
{
	struct microfacet m;
	struct boundary_row *r = &t->row[row];
	double alpha = t->min_alpha * exp(row * t->log_step), sum = 0;
	microfacet_init(&m, t->is_ggx, alpha, alpha);
	for (int i = 0; i < BOUNDARY_NODES; i++)
		r->transmittance[i] = 1 - boundary_reflectance(&m, t->eta, node_cosine(i));
	for (int i = 0; i < STEPS; i++) {
		double c = (i + 0.5) / STEPS;
		sum += interpolate_row(r->transmittance, c) * 2 * c;
	}
	r->escape = sum / STEPS;
}

static const struct boundary_table *find_table(const struct boundary_table *wanted, const struct boundary_table *tables)
{
	for (const struct boundary_table *t = tables; t; t = t->next)
		if (t->is_ggx == wanted->is_ggx && t->eta == wanted->eta && t->min_alpha == wanted->min_alpha &&
		    t->log_step == wanted->log_step && t->row_count == wanted->row_count)
			return t;
	return NULL;
}

/* Returns a table that the scene has already, or a new one. NULL if out of memory. */
static const struct boundary_table *get_table(const struct rough_map *roughness, double eta,
					      const struct bsdf_build *build)
{
	struct boundary_table wanted = {.is_ggx = roughness->narrowest_facets.is_ggx,
					.eta = eta,
					.min_alpha = roughness->narrowest_facets.alpha,
					.row_count = 1,
					.next = build->boundary_tables ? *build->boundary_tables : NULL};
	if (roughness->is_textured && roughness->max_alpha > wanted.min_alpha) {
		wanted.row_count = BOUNDARY_ROWS;
		wanted.log_step = log(roughness->max_alpha / wanted.min_alpha) / (BOUNDARY_ROWS - 1);
	}
	const struct boundary_table *found = find_table(&wanted, wanted.next);
	if (found)
		return found;
	struct boundary_table *t = arena_alloc(build->arena, 1, sizeof *t);
	wanted.row = arena_alloc(build->arena, (size_t)wanted.row_count, sizeof *wanted.row);
	if (!t || !wanted.row)
		return NULL;
	*t = wanted;
	for (int i = 0; i < t->row_count; i++)
		tabulate_row(t, i);
	if (build->boundary_tables)
		*build->boundary_tables = t;
	return t;
}

int rough_boundary_read(struct rough_boundary *r, double eta, struct bsdf *b, const struct scene_node *n,
			const struct bsdf_build *build, struct error *e)
{
	int code = rough_map_read(&r->roughness, b, n, build, e);
	bool has_alpha_uv = node_find_property(n, "alpha_u") || node_find_property(n, "alpha_v");
	if (!code && (r->roughness.narrowest_facets.ratio != 1 || (r->roughness.is_textured && has_alpha_uv)))
		code = node_error(n, e, ENOTSUP, "alpha_u and alpha_v differ; only isotropic coatings are supported");
	if (code)
		return code;
	r->table = get_table(&r->roughness, eta, build);
	return r->table ? 0 : node_error(n, e, ENOMEM, "out of memory");
}

struct boundary_point rough_boundary_at(const struct rough_boundary *r, const struct bsdf_point *p)
{
	const struct boundary_table *t = r->table;
	struct boundary_point point = {.table = t, .facets = rough_map_at(&r->roughness, p)};
	if (t->row_count > 1) {
		double x = fmin(fmax(log(point.facets.alpha / t->min_alpha) / t->log_step, 0), t->row_count - 1);
		point.row = x < t->row_count - 2 ? (int)x : t->row_count - 2;
		point.row_fraction = x - point.row;
	}
	return point;
}

static double lerp(double t, double a, double b)
{
	return t > 0 ? (1 - t) * a + t * b : a;
}

double rough_boundary_transmittance(const struct boundary_point *point, double cosine)
{
	const struct boundary_row *r = &point->table->row[point->row];
	double value = interpolate_row(r->transmittance, cosine);
	return point->row_fraction > 0 ? lerp(point->row_fraction, value, interpolate_row(r[1].transmittance, cosine))
				       : value;
}

double rough_boundary_escape(const struct boundary_point *point)
{
	const struct boundary_row *r = &point->table->row[point->row];
	return point->row_fraction > 0 ? lerp(point->row_fraction, r->escape, r[1].escape) : r->escape;
}

double rough_boundary_reflect(const struct boundary_point *point, vec3 wo, vec3 wi, double *pdf)
{
	return microfacet_reflect(&point->facets, point->table->eta, wo, wi, pdf);
}
