/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/rough_boundary.h"

#include "worker/render/bsdf/fresnel.h"

enum { SIDE = 16, STEPS = 1024 };

/* The share of light from v that the boundary reflects to the same side: visible normals, by the midpoint rule. */
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

static void tabulate(struct rough_boundary *r, int row)
{
	struct microfacet m;
	double alpha = r->least * exp(row * r->step), sum = 0;
	microfacet_set(&m, r->roughness.fixed.ggx, alpha, alpha);
	for (int i = 0; i < BOUNDARY_NODES; i++)
		r->transmitted[row][i] = 1 - reflected_by(&m, r->eta, node_cosine(i));
	for (int i = 0; i < STEPS; i++) {
		double c = (i + 0.5) / STEPS;
		sum += look_up(r->transmitted[row], c) * 2 * c;
	}
	r->escape[row] = sum / STEPS;
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
	r->eta = eta;
	r->least = r->roughness.fixed.alpha;
	r->rows = r->roughness.varies && r->roughness.most > r->least ? BOUNDARY_ROWS : 1;
	r->step = r->rows > 1 ? log(r->roughness.most / r->least) / (r->rows - 1) : 0;
	for (int i = 0; i < r->rows; i++)
		tabulate(r, i);
	return 0;
}

struct boundary_point rough_boundary_at(const struct rough_boundary *r, const struct bsdf_point *p)
{
	struct boundary_point at = {.of = r, .facets = rough_map_at(&r->roughness, p)};
	if (r->rows > 1) {
		double x = fmin(fmax(log(at.facets.alpha / r->least) / r->step, 0), r->rows - 1);
		at.row = x < r->rows - 2 ? (int)x : r->rows - 2;
		at.rest = x - at.row;
	}
	return at;
}

static double between(double rest, double here, double next)
{
	return rest > 0 ? (1 - rest) * here + rest * next : here;
}

double boundary_transmitted(const struct boundary_point *at, double cosine)
{
	const struct rough_boundary *r = at->of;
	double here = look_up(r->transmitted[at->row], cosine);
	return at->rest > 0 ? between(at->rest, here, look_up(r->transmitted[at->row + 1], cosine)) : here;
}

double boundary_escape(const struct boundary_point *at)
{
	const double *escape = at->of->escape;
	return at->rest > 0 ? between(at->rest, escape[at->row], escape[at->row + 1]) : escape[at->row];
}

double boundary_reflect(const struct boundary_point *at, vec3 wo, vec3 wi, double *pdf)
{
	double length;
	vec3 h;
	*pdf = 0;
	if (!microfacet_half(wo, 1, wi, &h, &length))
		return 0;
	*pdf = 0.25 * microfacet_d(&at->facets, h) * microfacet_g1_over_cos(&at->facets, wo);
	return *pdf * microfacet_g1_over_cos(&at->facets, wi) *
	       fresnel_dielectric(fmin(0.5 * length, 1), at->of->eta).reflected;
}

vec3 boundary_sample(const struct boundary_point *at, vec3 wo, double u0, double u1)
{
	vec3 h = microfacet_sample_visible(&at->facets, wo, u0, u1);
	return vec3_normalize(vec3_sub(vec3_scale(2 * vec3_dot(wo, h), h), wo));
}
