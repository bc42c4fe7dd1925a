/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/rough_boundary.h"

#include "worker/render/bsdf/fresnel.h"

enum { SIDE = 16, STEPS = 1024 };

/* Returns the share of light at an angle that the boundary reflects to the same side: the integral over visible
 * normals, by the midpoint rule. */
static double reflected_by(const struct microfacet *m, double eta, double cosine)
{
	double sum = 0;
	vec3 v = {sqrt((1 - cosine) * (1 + cosine)), 0, cosine};
	for (int i = 0; i < SIDE * SIDE; i++) {
		vec3 h = microfacet_sample_visible(m, v, (i / SIDE + 0.5) / SIDE, (i % SIDE + 0.5) / SIDE);
		double c = fmin(vec3_dot(v, h), 1);
		vec3 w = vec3_sub(vec3_scale(2 * c, h), v);
		if (c > 0 && w.z > 0)
			sum += fresnel_dielectric(c, eta).reflected *
			       fmin(microfacet_g1_over_cos(m, vec3_normalize(w)) * w.z, 1);
	}
	return sum / (SIDE * SIDE);
}

static double node_cosine(int i)
{
	double x = fmax((double)i / (BOUNDARY_NODES - 1), 1e-3);
	return x * x;
}

static double look_up(const double row[BOUNDARY_NODES], double cosine)
{
	double x = sqrt(fmin(cosine, 1)) * (BOUNDARY_NODES - 1);
	int i = x < BOUNDARY_NODES - 2 ? (int)x : BOUNDARY_NODES - 2;
	double t = x - i;
	return (1 - t) * row[i] + t * row[i + 1];
}

static void tabulate(const struct boundary_table *t, int row)
{
	struct microfacet m;
	struct boundary_row *r = &t->row[row];
	double alpha = t->least * exp(row * t->step), sum = 0;
	microfacet_set(&m, t->ggx, alpha, alpha);
	for (int i = 0; i < BOUNDARY_NODES; i++)
		r->transmitted[i] = 1 - reflected_by(&m, t->eta, node_cosine(i));
	for (int i = 0; i < STEPS; i++) {
		double c = (i + 0.5) / STEPS;
		sum += look_up(r->transmitted, c) * 2 * c;
	}
	r->escape = sum / STEPS;
}

static const struct boundary_table *find_table(const struct boundary_table *like, const struct boundary_table *made)
{
	for (const struct boundary_table *t = made; t; t = t->next)
		if (t->ggx == like->ggx && t->eta == like->eta && t->least == like->least && t->step == like->step &&
		    t->rows == like->rows)
			return t;
	return NULL;
}

/* Returns a table that the scene has already, or a new one. NULL if out of memory. */
static const struct boundary_table *table_of(const struct rough_map *roughness, double eta,
					     const struct bsdf_build *build)
{
	struct boundary_table wanted = {.ggx = roughness->fixed.ggx,
					.eta = eta,
					.least = roughness->fixed.alpha,
					.rows = 1,
					.next = build->boundaries ? *build->boundaries : NULL};
	if (roughness->varies && roughness->most > wanted.least) {
		wanted.rows = BOUNDARY_ROWS;
		wanted.step = log(roughness->most / wanted.least) / (BOUNDARY_ROWS - 1);
	}
	const struct boundary_table *found = find_table(&wanted, wanted.next);
	if (found)
		return found;
	struct boundary_table *t = arena_alloc(build->arena, 1, sizeof *t);
	wanted.row = arena_alloc(build->arena, (size_t)wanted.rows, sizeof *wanted.row);
	if (!t || !wanted.row)
		return NULL;
	*t = wanted;
	for (int i = 0; i < t->rows; i++)
		tabulate(t, i);
	if (build->boundaries)
		*build->boundaries = t;
	return t;
}

int rough_boundary_read(struct rough_boundary *r, double eta, struct bsdf *b, const struct scene_node *n,
			const struct bsdf_build *build, struct error *e)
{
	int code = rough_map_read(&r->roughness, b, n, build, e);
	bool both = node_find(n, "alpha_u") || node_find(n, "alpha_v");
	if (!code && (r->roughness.fixed.ratio != 1 || (r->roughness.varies && both)))
		code = node_error(n, e, ENOTSUP, "alpha_u and alpha_v differ; only isotropic coatings are supported");
	if (code)
		return code;
	r->table = table_of(&r->roughness, eta, build);
	return r->table ? 0 : node_error(n, e, ENOMEM, "out of memory");
}

struct boundary_point rough_boundary_at(const struct rough_boundary *r, const struct bsdf_point *p)
{
	const struct boundary_table *t = r->table;
	struct boundary_point at = {.of = t, .facets = rough_map_at(&r->roughness, p)};
	if (t->rows > 1) {
		double x = fmin(fmax(log(at.facets.alpha / t->least) / t->step, 0), t->rows - 1);
		at.row = x < t->rows - 2 ? (int)x : t->rows - 2;
		at.rest = x - at.row;
	}
	return at;
}

static double lerp(double rest, double here, double next)
{
	return rest > 0 ? (1 - rest) * here + rest * next : here;
}

double boundary_transmitted(const struct boundary_point *at, double cosine)
{
	const struct boundary_row *r = &at->of->row[at->row];
	double here = look_up(r->transmitted, cosine);
	return at->rest > 0 ? lerp(at->rest, here, look_up(r[1].transmitted, cosine)) : here;
}

double boundary_escape(const struct boundary_point *at)
{
	const struct boundary_row *r = &at->of->row[at->row];
	return at->rest > 0 ? lerp(at->rest, r->escape, r[1].escape) : r->escape;
}

double boundary_reflect(const struct boundary_point *at, vec3 wo, vec3 wi, double *pdf)
{
	return microfacet_reflect(&at->facets, at->of->eta, wo, wi, pdf);
}
