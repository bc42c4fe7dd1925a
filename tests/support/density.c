/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Recomputes all densities of a path (density.h) from positions, normals and BSDFs alone: per solid angle from the
 * BSDF's pdf, per area by the cosine over the squared distance, in media times the density of the distance, in both
 * directions of each route. Paths for which rounding is decisive (grazing angles, vertices that nearly touch) are left
 * out and counted.
 */
#include "tests/support/density.h"

#include "tests/support/dice.h"
#include "tests/support/slow_grid.h"
#include "tests/support/stats.h"
#include "worker/render/path/connect.h"
#include "worker/render/world/build.h"
#include "worker/render/world/emitter_choice.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { DEPTH = 7 };

/* x[0] on the emitter .. x[k] at the camera; from_light[i], from_camera[i]: density of x[i] as generated from that
 * side. */
struct route {
	unsigned k;
	struct path_vertex x[DEPTH + 2];
	bool delta[DEPTH + 2];
	double from_light[DEPTH + 2], from_camera[DEPTH + 2];
};

static double squared(double x)
{
	return x * x;
}

static vec3 towards(const struct path_vertex *a, const struct path_vertex *b)
{
	if (b->kind == VERTEX_INFINITE)
		return b->x.p;
	if (a->kind == VERTEX_INFINITE)
		return vec3_neg(a->x.p);
	return vec3_normalize(vec3_sub(b->x.p, a->x.p));
}

static bool on_delta(const struct path_context *c, const struct path_vertex *x0)
{
	return c->w->emitters[x0->emitter].delta;
}

static double per_area(const struct path_vertex *at, const struct path_vertex *to)
{
	if (to->kind == VERTEX_INFINITE)
		return 1;
	vec3 d = vec3_sub(to->x.p, at->x.p);
	if (to->kind == VERTEX_MEDIUM)
		return 1 / vec3_dot(d, d);
	return fabs(vec3_dot(to->x.ng, towards(at, to))) / vec3_dot(d, d);
}

/* Returns by how much a channel of the grid enters sigma_t along d; in a homogeneous medium, sigma_t. */
static double coefficient(const struct path_context *c, vec3 d, int channel, int lane)
{
	const struct medium *m = &c->w->media[0];
	if (!m->first.grid)
		return medium_extinction(m, (vec3){0, 0, 0}, d, &c->wl).v[lane];
	if (m->first.grid->channels == 1)
		return m->per_length;
	double sum = 0, own = 0;
	for (int k = 0; k < m->first.grid->channels; k++) {
		double x = color_eval(&m->first.primary[k], &c->wl).v[lane];
		sum += x;
		own = k == channel ? x : own;
	}
	return m->per_length * own / sum;
}

/* Returns sigma_t of the only medium, which is everywhere. */
static double sigma_at(const struct path_context *c, const struct path_vertex *v, vec3 d, int lane)
{
	const struct grid *g = c->w->media[0].first.grid;
	double x[3], sum = 0;
	if (!g)
		return coefficient(c, d, 0, lane);
	slow_grid_cells(g, &(struct grid_ray){v->x.p, {0, 0, 0}, 0, 0}, 0, x);
	for (int k = 0; k < g->channels && slow_grid_has(g, v->x.p); k++)
		sum += coefficient(c, d, k, lane) * slow_grid_value(g, x, k);
	return sum;
}

/* Returns the medium's optical depth; before a camera's near plane there is none. */
static spectrum depth_between(const struct path_context *c, const struct path_vertex *a, const struct path_vertex *b)
{
	const struct grid *g = c->w->media[0].first.grid;
	const struct path_vertex *eye = b->kind == VERTEX_CAMERA ? b : a, *other = eye == a ? b : a;
	double t_min = 0, t_max, length = vec3_length(vec3_sub(a->x.p, b->x.p));
	spectrum depth = spectrum_of(0);
	struct camera now;
	if (eye->kind == VERTEX_CAMERA)
		camera_clip(world_camera(c->w, &eye->x, &now), towards(eye, other), &t_min, &t_max);
	const struct grid_ray r = {eye->x.p, towards(eye, other), t_min, length};
	for (int k = 0; k < (g ? g->channels : 1); k++) {
		double along = g ? slow_grid_integral(g, &r, k) : length - t_min;
		for (int i = 0; i < SPECTRUM_LANES; i++)
			depth.v[i] += coefficient(c, r.d, k, i) * along;
	}
	return depth;
}

/* Returns the factor of the distance in the density of `to`: for one wavelength of four, of an event or of none. */
static double by_distance(const struct path_context *c, const struct path_vertex *at, const struct path_vertex *to)
{
	double sum = 0;
	if (!c->w->effects.scattering)
		return 1;
	spectrum depth = depth_between(c, at, to);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		sum += exp(-depth.v[i]) * (to->kind == VERTEX_MEDIUM ? sigma_at(c, to, towards(at, to), i) : 1);
	return sum / SPECTRUM_LANES;
}

/* Returns the transmittance at the first wavelength. */
static double left_over(const struct path_context *c, const struct path_vertex *a, const struct path_vertex *b)
{
	if (!c->w->effects.scattering)
		return 1;
	return exp(-depth_between(c, a, b).v[0]);
}

static struct emitter_point emitter_point_of(const struct path_vertex *v)
{
	struct emitter_point p = world_emitter_point(&v->x);
	p.infinite = v->kind == VERTEX_INFINITE;
	return p;
}

/* A normal that relief turns away from the camera is mirrored at the geometric one: shapes with such relief are flat
 * or spheres here. */
static bool turned_from(const struct path_vertex *at, const struct path_vertex *camera, struct surface_point *x)
{
	vec3 w = towards(at, camera);
	*x = at->x;
	if (!x->shape->relief || !x->shape->relief->turns || at->bsdf->has_delta ||
	    vec3_dot(x->ng, w) * vec3_dot(x->sh.n, w) > 0)
		return false;
	x->sh = frame_along(vec3_sub(vec3_scale(2 * vec3_dot(x->sh.n, x->ng), x->ng), x->sh.n), x->axis);
	return true;
}

/* Returns the specular lobe that leads from `from` over `at` to `to`. */
static struct bsdf_sample specular_lobe(const struct path_context *c, const struct path_vertex *from,
					const struct path_vertex *at, const struct path_vertex *to,
					enum transport transport)
{
	struct bsdf_point p = world_bsdf_point(&at->x, &c->wl, transport);
	vec3 wo = frame_to_local(&at->x.sh, towards(at, from)), wi = frame_to_local(&at->x.sh, towards(at, to));
	for (int i = 0; i < 2; i++) {
		double u[3] = {0.5, 0.5, i ? 1 - 0x1p-53 : 0};
		struct bsdf_sample s;
		if (at->bsdf->ops->sample(at->bsdf, &p, wo, u, &s) && s.wi.z * wi.z > 0) {
			assert_true(vec3_length(vec3_sub(s.wi, wi)) < 1e-6);
			return s;
		}
	}
	return (struct bsdf_sample){.pdf = 0};
}

/* Returns the density of `to`, generated at `at` when coming from `from`. For specular lobes it is a distribution in
 * the direction towards the light, projected on the geometric normal. The solid angle towards the camera is related to
 * it by the squared indices and the cosines with the shading normal, about which light is refracted (etendue). */
static double scattering_pdf(const struct path_context *c, const struct path_vertex *from, const struct path_vertex *at,
			     bool delta, const struct path_vertex *to, enum transport transport)
{
	struct surface_point x;
	if (at->kind == VERTEX_MEDIUM)
		return phase_eval(&c->w->media[0].phase, at->x.p, towards(at, from), towards(at, to)) *
		       per_area(at, to);
	bool from_light = transport == TRANSPORT_IMPORTANCE, turned = turned_from(at, from_light ? to : from, &x);
	if (from_light && turned)
		return 0;
	vec3 wo = frame_to_local(&x.sh, towards(at, from)), wi = frame_to_local(&x.sh, towards(at, to));
	if (!delta) {
		struct bsdf_point p = world_bsdf_point(&x, &c->wl, transport);
		return at->bsdf->ops->pdf_solid(at->bsdf, &p, wo, wi) * per_area(at, to);
	}
	double density = specular_lobe(c, from, at, to, transport).pdf * per_area(at, to);
	if (transport == TRANSPORT_RADIANCE)
		return density * fabs(vec3_dot(at->x.ng, towards(at, to)));
	density *= fabs(wi.z / wo.z) * fabs(vec3_dot(at->x.ng, towards(at, from)));
	if (wo.z * wi.z < 0)
		density *= wi.z > 0 ? squared(1 / bsdf_eta(at->bsdf, &c->wl)) : squared(bsdf_eta(at->bsdf, &c->wl));
	return density;
}

static double density_from_light(const struct path_context *c, const struct route *r, unsigned i)
{
	const struct path_vertex *x = r->x;
	const struct emitter *em = &c->w->emitters[x[0].emitter];
	struct emitter_point p = emitter_point_of(&x[0]);
	if (i == 0)
		return c->w->emitter_pdf[x[0].emitter] * em->ops->pdf_point(em, &p);
	if (i >= 2)
		return scattering_pdf(c, &x[i - 2], &x[i - 1], r->delta[i - 1], &x[i], TRANSPORT_IMPORTANCE) *
		       by_distance(c, &x[i - 1], &x[i]);
	vec3 w = towards(&x[0], &x[1]);
	if (x[0].kind == VERTEX_INFINITE)
		return fabs(vec3_dot(x[1].x.ng, w)) / (M_PI * squared(c->w->radius));
	return em->ops->pdf_direction(em, &p, w) * per_area(&x[0], &x[1]) * by_distance(c, &x[0], &x[1]);
}

static double density_from_camera(const struct path_context *c, const struct route *r, unsigned i)
{
	const struct path_vertex *x = r->x;
	if (i == r->k)
		return 1;
	if (i == 0 && on_delta(c, &x[0]))
		return 0;
	if (i + 2 <= r->k)
		return scattering_pdf(c, &x[i + 2], &x[i + 1], r->delta[i + 1], &x[i], TRANSPORT_RADIANCE) *
		       by_distance(c, &x[i + 1], &x[i]);
	vec3 w = towards(&x[r->k], &x[i]);
	double cosine = vec3_dot(c->w->camera.axes.n, w), pixels = c->window.width * c->window.height;
	return squared(c->w->camera.scale) / (cosine * cosine * cosine * pixels) * per_area(&x[r->k], &x[i]) *
	       by_distance(c, &x[r->k], &x[i]);
}

/* Returns false if double precision cannot decide: two points almost coincide, or are seen at a grazing angle. */
static bool well_conditioned(const struct route *r)
{
	for (unsigned i = 0; i < r->k; i++) {
		const struct path_vertex *a = &r->x[i], *b = &r->x[i + 1];
		vec3 w = towards(a, b);
		bool has_normal = a->kind != VERTEX_INFINITE && vec3_length(a->x.ng) > 0;
		if (a->kind != VERTEX_INFINITE && vec3_length(vec3_sub(a->x.p, b->x.p)) < 1e-3)
			return false;
		if (has_normal && fabs(vec3_dot(w, a->x.ng)) < 1e-3)
			return false;
		if (b->kind != VERTEX_CAMERA && b->kind != VERTEX_MEDIUM && fabs(vec3_dot(w, b->x.ng)) < 1e-3)
			return false;
	}
	return true;
}

static double relative(double a, double b)
{
	return a == b ? 0 : fabs(a - b) / fmax(fabs(a), fabs(b));
}

/* Assembles the path that technique s made. */
static void take_route(const struct path_context *c, unsigned s, unsigned t, const struct path_vertex *light,
		       struct route *r)
{
	*r = (struct route){.k = s + t - 1};
	for (unsigned i = 0; i < s; i++)
		r->x[i] = light[i];
	for (unsigned i = 0; i < t; i++)
		r->x[r->k - i] = c->camera[i];
	for (unsigned i = 1; i < r->k; i++)
		r->delta[i] = r->x[i].delta && i + 1 != s && i != s;
}

static void fill_densities(const struct path_context *c, struct route *r)
{
	for (unsigned i = 0; i <= r->k; i++) {
		r->from_light[i] = density_from_light(c, r, i);
		r->from_camera[i] = density_from_camera(c, r, i);
	}
}

/* At the distances and cosines allowed, directions between points are off by 1e-13, which lobes as narrow as alpha
 * 0.1 amplify by 1e3. A hit that Embree's floats place just beside its triangle is moved by up to 1e-7 off the ray,
 * which is rare and is counted. */
static void compare(struct density_tally *tally, double a, double b)
{
	if (relative(a, b) < 1e-9)
		tally->worst = fmax(tally->worst, relative(a, b));
	else if (relative(a, b) < 1e-5)
		tally->off++;
	else
		fail_msg("%.12g is to be %.12g", a, b);
}

static void check_walk(const struct route *r, unsigned s, struct density_tally *tally)
{
	for (unsigned i = 0; i <= r->k; i++) {
		bool light = i < s;
		double own = light ? r->from_light[i] : r->from_camera[i],
		       other = light ? r->from_camera[i] : r->from_light[i];
		compare(tally, r->x[i].pdf, own);
		/* The reverse density needs two more vertices of the same sub-path. */
		if (light ? i + 3 <= s : i >= s + 2 && i < r->k)
			compare(tally, r->x[i].pdf_rev, other);
	}
}

/* Returns F of path.h's head comment; for a specular lobe, the factor before the delta distribution. */
static double scatter(const struct path_context *c, const struct path_vertex *camera, const struct path_vertex *at,
		      const struct path_vertex *light)
{
	if (at->kind == VERTEX_MEDIUM)
		return medium_scattering(&c->w->media[0], at->x.p, towards(at, camera), &c->wl).v[0] *
		       phase_eval(&c->w->media[0].phase, at->x.p, towards(at, camera), towards(at, light));
	if (at->delta) {
		struct bsdf_sample s = specular_lobe(c, camera, at, light, TRANSPORT_RADIANCE);
		return s.f.v[0] * fabs(s.wi.z);
	}
	struct surface_point x;
	turned_from(at, camera, &x);
	struct bsdf_point p = world_bsdf_point(&x, &c->wl, TRANSPORT_RADIANCE);
	vec3 wo = towards(at, camera), wi = towards(at, light);
	spectrum f = at->bsdf->ops->eval(at->bsdf, &p, frame_to_local(&x.sh, wo), frame_to_local(&x.sh, wi));
	return f.v[0] * fabs(vec3_dot(x.sh.n, wi) / vec3_dot(x.ng, wi));
}

/* Checks, along a sub-path: beta x densities = source x product of F x product of G. */
static void check_beta(const struct path_context *c, const struct path_vertex *v, unsigned n,
		       struct density_tally *tally)
{
	double density = v[0].pdf, value;
	bool light = v[0].kind != VERTEX_CAMERA;
	vec3 w = towards(&v[0], &v[1]);
	if (light) {
		const struct emitter *em = &c->w->emitters[v[0].emitter];
		struct emitter_point p = emitter_point_of(&v[0]);
		value = em->ops->radiance(em, &p, w, &c->wl).v[0];
		double leaving = on_delta(c, &v[0]) ? 1 : fabs(vec3_dot(v[0].x.ng, w));
		value *= v[0].kind == VERTEX_INFINITE ? fabs(vec3_dot(v[1].x.ng, w)) : leaving * per_area(&v[0], &v[1]);
	} else {
		value = squared(c->w->camera.scale) / pow(vec3_dot(c->w->camera.axes.n, w), 3) * per_area(&v[0], &v[1]);
	}
	for (unsigned i = 1; i < n; i++) {
		density *= v[i].pdf;
		value *= left_over(c, &v[i - 1], &v[i]);
		compare(tally, v[i].beta.v[0] * density, value);
		tally->betas++;
		if (i + 1 == n)
			return;
		value *= light ? scatter(c, &v[i + 1], &v[i], &v[i - 1]) : scatter(c, &v[i - 1], &v[i], &v[i + 1]);
		value *= path_cosine(&v[i], towards(&v[i], &v[i + 1])) * per_area(&v[i], &v[i + 1]);
	}
}

/* Returns the first vertex from x_j on that technique j joins: light goes straight through those before it. */
static unsigned joined_to(const struct path_context *c, const struct route *r, unsigned j)
{
	while (c->w->effects.transparent_shadows && j < r->k && r->delta[j] && (r->x[j].mode & BSDF_STRAIGHT))
		j++;
	return j;
}

/* Returns the density of x_0 as next event estimation draws it. */
static double direct_pdf(const struct path_context *c, const struct route *r)
{
	const struct emitter *em = &c->w->emitters[r->x[0].emitter];
	struct emitter_point p = emitter_point_of(&r->x[0]);
	vec3 lit = r->x[joined_to(c, r, 1)].x.p;
	return emitter_choice_denser(c->w, lit, r->x[0].emitter, em, &p) * emitter_pdf_toward(em, lit, &p);
}

static double cosine_at(const struct path_vertex *v, vec3 w)
{
	bool has_normal = v->kind == VERTEX_SURFACE || (v->kind == VERTEX_EMITTER && vec3_length(v->x.ng) > 0);
	return has_normal ? fabs(vec3_dot(v->x.ng, w)) : 1;
}

static double geometry(const struct path_vertex *a, const struct path_vertex *b)
{
	vec3 w = towards(a, b), d = vec3_sub(a->x.p, b->x.p);
	bool endless = a->kind == VERTEX_INFINITE || b->kind == VERTEX_INFINITE;
	return cosine_at(a, w) * cosine_at(b, w) / (endless ? 1 : vec3_dot(d, d));
}

static bool is_joint(const struct path_context *c, const struct route *r, unsigned j)
{
	if (j == 0)
		return !on_delta(c, &r->x[0]);
	unsigned end = joined_to(c, r, j);
	if (j == 1 && end == r->k)
		return c->joins_lens && r->x[0].kind != VERTEX_INFINITE && !on_delta(c, &r->x[0]) &&
		       direct_pdf(c, r) >= PATH_LENS_DENSER * (c->light_every ? c->light_every : 1) *
						   path_pdf(c, NULL, &r->x[end], &r->x[0], TRANSPORT_RADIANCE);
	return !r->delta[j - 1] && !r->delta[end];
}

/* Returns the logarithm of the density of the whole path by technique j. Vertices that light passes straight follow
 * from the ends: the geometry terms of the small edges replace the long one's. */
static double technique_pdf(const struct path_context *c, const struct route *r, unsigned j)
{
	unsigned end = j > 0 ? joined_to(c, r, j) : 0;
	double sum = 0;
	for (unsigned i = 0; i < j; i++)
		sum += log(r->from_light[i]);
	for (unsigned i = end; i <= r->k; i++)
		sum += log(r->from_camera[i]);
	for (unsigned i = j; i <= end && end > j; i++)
		sum += log(geometry(&r->x[i], &r->x[i - 1]));
	if (end > j)
		sum -= log(geometry(&r->x[end], &r->x[j - 1]));
	if (j != 1)
		return sum;
	return sum - log(r->from_light[0]) + log(direct_pdf(c, r));
}

/* Returns the edge between two points, as a sub-path makes it. */
static struct path_edge edge_between(const struct path_context *c, const struct path_vertex *a,
				     const struct path_vertex *b)
{
	struct path_edge e = {.medium = 1, .before = 1, .fits = true, .d = towards(a, b)};
	spectrum depth = depth_between(c, a, b);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		e.free.v[i] = exp(-depth.v[i]);
	return e;
}

/* Relabels the path as if technique s had made it. */
static void relabel_vertices(const struct path_context *c, struct route *r, unsigned s, struct joined_path *p,
			     struct path_edge *joint)
{
	p->edges = r->k;
	p->s = s;
	p->passed = s > 0 ? joined_to(c, r, s) - s : 0;
	p->other_medium = 0;
	p->joint = joint;
	for (unsigned i = 1; i <= r->k && c->w->effects.scattering; i++) {
		struct path_edge *edge = i == s ? joint : i < s ? &r->x[i].edge : &r->x[i - 1].edge;
		*edge = edge_between(c, &r->x[i], &r->x[i - 1]);
	}
	for (unsigned i = 0; i <= r->k; i++) {
		struct path_vertex *v = &r->x[i];
		v->delta = r->delta[i];
		v->pdf = i < s ? r->from_light[i] : r->from_camera[i];
		/* The sub-path does not reach far enough to know this. */
		v->pdf_rev = NAN;
		if (i + 3 <= s || i >= s + p->passed + 2)
			v->pdf_rev = i < s ? r->from_camera[i] : r->from_light[i];
		p->v[i] = v;
	}
	if (r->x[0].kind != VERTEX_INFINITE)
		r->x[0].kind = s ? VERTEX_EMITTER : VERTEX_SURFACE;
}

/* If only one in eight samples has a light sub-path, techniques with two light vertices or more count for an eighth,
 * and so does the one that joins an emitter to the lens. */
static void check_rare_light(struct path_context *c, const struct route *r, const struct joined_path *p,
			     const double *ratio)
{
	double sum = 0;
	c->light_every = 8;
	bool made = is_joint(c, r, p->s);
	for (unsigned j = 0; j <= p->edges; j++)
		if (is_joint(c, r, j))
			sum += j < (joined_to(c, r, 1) == p->edges ? 1 : 2) ? ratio[j] : 0.125 * ratio[j];
	double weight = made ? path_balance_weight(c, p, PATH_MAX_EDGES) : 1 / sum;
	c->light_every = 1;
	if (!(relative(weight, 1 / sum) < 1e-12))
		fail_msg("made by %u of %u, light in one of eight: weight %.12g, not %.12g", p->s, p->edges, weight,
			 1 / sum);
}

static void check_ratios(struct path_context *c, struct route *r, struct density_tally *tally)
{
	double p[DEPTH + 2], ratio[DEPTH + 2], most = -INFINITY;
	for (unsigned j = 0; j <= r->k; j++) {
		p[j] = technique_pdf(c, r, j);
		most = fmax(most, p[j]);
		if (!is_joint(c, r, j))
			p[j] = -INFINITY;
	}
	for (unsigned s = 0; s <= r->k; s++) {
		struct joined_path joined;
		struct path_edge joint;
		/* Techniques whose density is 1e100 times smaller than that of another never make the path. */
		if (!is_joint(c, r, s) || most - p[s] > 230)
			continue;
		relabel_vertices(c, r, s, &joined, &joint);
		tally->passed += joined.passed > 0;
		for (unsigned max_s = s > 1 ? PATH_MAX_EDGES : 1; max_s <= PATH_MAX_EDGES;
		     max_s += PATH_MAX_EDGES - 1) {
			path_technique_ratios(c, &joined, max_s, ratio);
			double sum = 0;
			for (unsigned j = 0; j <= r->k; j++) {
				double expected = j <= max_s ? exp(p[j] - p[s]) : 0;
				sum += expected;
				if (!(relative(ratio[j], expected) < 1e-9))
					fail_msg("technique %u of %u edges, made by %u: %.12g instead of %.12g", j,
						 r->k, s, ratio[j], expected);
				tally->worst_ratio = fmax(tally->worst_ratio, relative(ratio[j], expected));
			}
			double weight = path_balance_weight(c, &joined, max_s);
			if (!(relative(weight, 1 / sum) < 1e-9))
				fail_msg("made by %u of %u, up to %u: weight %.12g, not %.12g", s, r->k, max_s, weight,
					 1 / sum);
		}
		check_rare_light(c, r, &joined, ratio); /* for all techniques */
		tally->relabelled++;
	}
}

static bool is_joinable(struct path_context *c, unsigned s, unsigned t)
{
	const struct path_vertex *z = &c->camera[t - 1];
	if (s == 0)
		return z->emitter >= 0 && vec3_dot(z->x.ng, z->to_prev) > 0;
	if (z->kind == VERTEX_INFINITE)
		return false;
	const struct path_vertex *y = &c->light[s - 1];
	vec3 w = towards(z, y);
	double film[2];
	struct camera now;
	if (t == 1 && !camera_project(world_camera(c->w, &z->x, &now), z->x.p, w, 1, &film[0], &film[1]))
		return false;
	if (t > 1 && spectrum_is_zero(path_scatter(c, z, z->to_prev, w)))
		return false;
	if (s > 1)
		return !spectrum_is_zero(path_scatter(c, y, vec3_neg(w), y->to_prev));
	const struct emitter *em = &c->w->emitters[y->emitter];
	struct emitter_point p = emitter_point_of(y);
	return !spectrum_is_zero(em->ops->radiance(em, &p, vec3_neg(w), &c->wl));
}

static void check_route(struct path_context *c, unsigned s, unsigned t, struct density_tally *tally)
{
	struct route r;
	take_route(c, s, t, c->light, &r);
	if (!well_conditioned(&r)) {
		tally->skipped++;
		return;
	}
	fill_densities(c, &r);
	check_walk(&r, s, tally);
	tally->routes++;
	tally->infinite += r.x[0].kind == VERTEX_INFINITE;
	for (unsigned i = 0; i <= r.k; i++)
		if (r.delta[i]) {
			tally->with_delta++;
			break;
		}
	check_ratios(c, &r, tally);
}

/* A vertex that is joined to the camera must land where the film sees it from this x_k. */
static void check_landing(struct path_context *c, unsigned s)
{
	double film[2];
	if (spectrum_is_zero(path_connect(c, s, 1, PATH_MAX_EDGES, film)))
		return;
	struct camera now;
	vec3 w = camera_direction(world_camera(c->w, &c->camera[0].x, &now), c->camera[0].x.p, film[0], film[1]);
	assert_true(vec3_length(vec3_sub(w, towards(&c->camera[0], &c->light[s - 1]))) < 1e-12);
}

struct density_tally density_check(const char *name, struct world *w, size_t walks)
{
	static struct path_context c;
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct density_tally tally = {0};
	c = (struct path_context){.w = w,
				  .window = {-1, -1, w->settings.width + 2.0, w->settings.height + 2.0},
				  .min_depth = 1,
				  .max_depth = DEPTH,
				  .counters = counters};
	for (uint64_t i = 0; i < dice_count(walks); i++) {
		struct sampler_random s;
		double film[2];
		sampler_random_init(&s, stats_seed(name), RNG_TEST, i, 0);
		/* On such a large film, emitters are small enough to be joined to the lens. */
		c.joins_lens = i % 4 == 1;
		const double border = c.joins_lens ? 10.0 * w->settings.width : 1;
		c.window = (struct film_window){-border, -border, w->settings.width + 2 * border,
						w->settings.height + 2 * border};
		unsigned camera = path_walk_camera(&c, &s.base, DEPTH + 1, film);
		unsigned light = path_walk_light(&c, &s.base, DEPTH);
		struct route whole;
		if (camera > 1) {
			take_route(&c, 0, camera, NULL, &whole);
			if (well_conditioned(&whole))
				check_beta(&c, c.camera, camera, &tally);
		}
		if (light > 1) {
			take_route(&c, light, 1, c.light, &whole);
			if (well_conditioned(&whole))
				check_beta(&c, c.light, light, &tally);
		}
		for (unsigned j = 2; j <= light; j++)
			check_landing(&c, j);
		for (unsigned t = 1; t <= camera; t++)
			for (unsigned j = t > 1 ? 0 : c.joins_lens ? 1 : 2; j <= light && t + j - 1 <= DEPTH; j++)
				if (t + j >= 2 && is_joinable(&c, j, t))
					check_route(&c, j, t, &tally);
	}
	print_message(
		"%s: %zu paths (%zu with specular vertices, %zu from infinity, %zu too flat to tell), %zu relabelled\n",
		name, tally.routes, tally.with_delta, tally.infinite, tally.skipped, tally.relabelled);
	print_message("  worst: pdf and beta (of %zu vertices) %.1e, ratio %.1e; %zu off the ray\n", tally.betas,
		      tally.worst, tally.worst_ratio, tally.off);
	assert_true(tally.off <= tally.routes / 200 + 10);
	assert_true(tally.routes > dice_count(walks) && 5 * tally.relabelled > 7 * tally.routes);
	world_free(w);
	return tally;
}
