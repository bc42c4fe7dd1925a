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

enum { DEPTH_MAX = 7 };

/* x[0] on the emitter .. x[k] at the camera; pdf_from_light[i], pdf_from_camera[i]: density of x[i] as generated from
 * that side. */
struct route {
	unsigned edges;
	struct path_vertex x[DEPTH_MAX + 2];
	bool is_delta[DEPTH_MAX + 2];
	double pdf_from_light[DEPTH_MAX + 2], pdf_from_camera[DEPTH_MAX + 2];
};

static double square(double x)
{
	return x * x;
}

static vec3 direction_to(const struct path_vertex *a, const struct path_vertex *b)
{
	if (b->kind == VERTEX_INFINITE)
		return b->x.p;
	if (a->kind == VERTEX_INFINITE)
		return vec3_neg(a->x.p);
	return vec3_normalize(vec3_sub(b->x.p, a->x.p));
}

static bool is_on_delta_emitter(const struct path_context *c, const struct path_vertex *x0)
{
	return c->w->emitters[x0->emitter].is_delta;
}

static double solid_angle_per_area(const struct path_vertex *vertex, const struct path_vertex *next)
{
	if (next->kind == VERTEX_INFINITE)
		return 1;
	vec3 d = vec3_sub(next->x.p, vertex->x.p);
	if (next->kind == VERTEX_MEDIUM)
		return 1 / vec3_dot(d, d);
	return fabs(vec3_dot(next->x.ng, direction_to(vertex, next))) / vec3_dot(d, d);
}

/* Returns by how much a channel of the grid enters sigma_t along d; in a homogeneous medium, sigma_t. */
static double extinction_coefficient(const struct path_context *c, vec3 d, int channel, int lane)
{
	const struct medium *m = &c->w->media[0];
	if (!m->first.grid)
		return medium_extinction(m, (vec3){0, 0, 0}, d, &c->wl).v[lane];
	if (m->first.grid->channels == 1)
		return m->per_length;
	double sum = 0, channel_value = 0;
	for (int k = 0; k < m->first.grid->channels; k++) {
		double x = color_eval(&m->first.primary[k], &c->wl).v[lane];
		sum += x;
		channel_value = k == channel ? x : channel_value;
	}
	return m->per_length * channel_value / sum;
}

/* Returns sigma_t of the only medium, which is everywhere. */
static double extinction_at(const struct path_context *c, const struct path_vertex *v, vec3 d, int lane)
{
	const struct grid *g = c->w->media[0].first.grid;
	double x[3], sum = 0;
	if (!g)
		return extinction_coefficient(c, d, 0, lane);
	slow_grid_position(g, &(struct grid_ray){v->x.p, {0, 0, 0}, 0, 0}, 0, x);
	for (int k = 0; k < g->channels && slow_grid_contains(g, v->x.p); k++)
		sum += extinction_coefficient(c, d, k, lane) * slow_grid_value(g, x, k);
	return sum;
}

/* Returns the medium's optical depth; before a camera's near plane there is none. */
static spectrum optical_depth(const struct path_context *c, const struct path_vertex *a, const struct path_vertex *b)
{
	const struct grid *g = c->w->media[0].first.grid;
	const struct path_vertex *eye = b->kind == VERTEX_CAMERA ? b : a, *other = eye == a ? b : a;
	double t_min = 0, t_max, length = vec3_length(vec3_sub(a->x.p, b->x.p));
	spectrum depth = spectrum_constant(0);
	struct camera moved_camera;
	if (eye->kind == VERTEX_CAMERA)
		camera_clip_range(world_camera_at(c->w, &eye->x, &moved_camera), direction_to(eye, other), &t_min,
				  &t_max);
	const struct grid_ray r = {eye->x.p, direction_to(eye, other), t_min, length};
	for (int k = 0; k < (g ? g->channels : 1); k++) {
		double along = g ? slow_grid_integral(g, &r, k) : length - t_min;
		for (int i = 0; i < SPECTRUM_LANES; i++)
			depth.v[i] += extinction_coefficient(c, r.d, k, i) * along;
	}
	return depth;
}

/* Returns the factor of the distance in the density of `next`: for one wavelength of four, of an event or of none. */
static double distance_factor(const struct path_context *c, const struct path_vertex *vertex,
			      const struct path_vertex *next)
{
	double sum = 0;
	if (!c->w->effects.scattering)
		return 1;
	spectrum depth = optical_depth(c, vertex, next);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		sum += exp(-depth.v[i]) *
		       (next->kind == VERTEX_MEDIUM ? extinction_at(c, next, direction_to(vertex, next), i) : 1);
	return sum / SPECTRUM_LANES;
}

/* Returns the transmittance at the first wavelength. */
static double transmittance_between(const struct path_context *c, const struct path_vertex *a,
				    const struct path_vertex *b)
{
	if (!c->w->effects.scattering)
		return 1;
	return exp(-optical_depth(c, a, b).v[0]);
}

static struct emitter_point make_emitter_point(const struct path_vertex *v)
{
	struct emitter_point p = world_emitter_point(&v->x);
	p.is_infinite = v->kind == VERTEX_INFINITE;
	return p;
}

/* A normal that relief turns away from the camera is mirrored at the geometric one: shapes with such relief are flat
 * or spheres here. */
static bool is_turned_from(const struct path_vertex *vertex, const struct path_vertex *camera, struct surface_point *x)
{
	vec3 w = direction_to(vertex, camera);
	*x = vertex->x;
	if (!x->shape->relief || !x->shape->relief->flips_invalid_normals || vertex->bsdf->has_delta ||
	    vec3_dot(x->ng, w) * vec3_dot(x->sh.n, w) > 0)
		return false;
	x->sh = frame_along(vec3_sub(vec3_scale(2 * vec3_dot(x->sh.n, x->ng), x->ng), x->sh.n), x->axis);
	return true;
}

/* Returns the specular lobe that leads from `previous` over `vertex` to `next`. */
static struct bsdf_sample specular_lobe(const struct path_context *c, const struct path_vertex *previous,
					const struct path_vertex *vertex, const struct path_vertex *next,
					enum transport transport)
{
	struct bsdf_point p = world_bsdf_point(&vertex->x, &c->wl, transport);
	vec3 wo = frame_to_local(&vertex->x.sh, direction_to(vertex, previous)),
	     wi = frame_to_local(&vertex->x.sh, direction_to(vertex, next));
	for (int i = 0; i < 2; i++) {
		double u[3] = {0.5, 0.5, i ? 1 - 0x1p-53 : 0};
		struct bsdf_sample s;
		if (vertex->bsdf->ops->sample(vertex->bsdf, &p, wo, u, &s) && s.wi.z * wi.z > 0) {
			assert_true(vec3_length(vec3_sub(s.wi, wi)) < 1e-6);
			return s;
		}
	}
	return (struct bsdf_sample){.pdf = 0};
}

/* Returns the density of `next`, generated at `vertex` when coming from `previous`. For specular lobes it is a
 * distribution in the direction towards the light, projected on the geometric normal. The solid angle towards the
 * camera is related to it by the squared indices and the cosines with the shading normal, about which light is
 * refracted (etendue). */
static double scattering_pdf(const struct path_context *c, const struct path_vertex *previous,
			     const struct path_vertex *vertex, bool delta, const struct path_vertex *next,
			     enum transport transport)
{
	struct surface_point x;
	if (vertex->kind == VERTEX_MEDIUM)
		return phase_eval(&c->w->media[0].phase, vertex->x.p, direction_to(vertex, previous),
				  direction_to(vertex, next)) *
		       solid_angle_per_area(vertex, next);
	bool from_light = transport == TRANSPORT_IMPORTANCE,
	     turned = is_turned_from(vertex, from_light ? next : previous, &x);
	if (from_light && turned)
		return 0;
	vec3 wo = frame_to_local(&x.sh, direction_to(vertex, previous)),
	     wi = frame_to_local(&x.sh, direction_to(vertex, next));
	if (!delta) {
		struct bsdf_point p = world_bsdf_point(&x, &c->wl, transport);
		return vertex->bsdf->ops->pdf_solid(vertex->bsdf, &p, wo, wi) * solid_angle_per_area(vertex, next);
	}
	double density = specular_lobe(c, previous, vertex, next, transport).pdf * solid_angle_per_area(vertex, next);
	if (transport == TRANSPORT_RADIANCE)
		return density * fabs(vec3_dot(vertex->x.ng, direction_to(vertex, next)));
	density *= fabs(wi.z / wo.z) * fabs(vec3_dot(vertex->x.ng, direction_to(vertex, previous)));
	if (wo.z * wi.z < 0)
		density *=
			wi.z > 0 ? square(1 / bsdf_eta(vertex->bsdf, &c->wl)) : square(bsdf_eta(vertex->bsdf, &c->wl));
	return density;
}

static double density_from_light(const struct path_context *c, const struct route *r, unsigned i)
{
	const struct path_vertex *x = r->x;
	const struct emitter *em = &c->w->emitters[x[0].emitter];
	struct emitter_point p = make_emitter_point(&x[0]);
	if (i == 0)
		return c->w->emitter_pdf[x[0].emitter] * em->ops->pdf_point(em, &p);
	if (i >= 2)
		return scattering_pdf(c, &x[i - 2], &x[i - 1], r->is_delta[i - 1], &x[i], TRANSPORT_IMPORTANCE) *
		       distance_factor(c, &x[i - 1], &x[i]);
	vec3 w = direction_to(&x[0], &x[1]);
	if (x[0].kind == VERTEX_INFINITE)
		return fabs(vec3_dot(x[1].x.ng, w)) / (M_PI * square(c->w->radius));
	return em->ops->pdf_direction(em, &p, w) * solid_angle_per_area(&x[0], &x[1]) *
	       distance_factor(c, &x[0], &x[1]);
}

static double density_from_camera(const struct path_context *c, const struct route *r, unsigned i)
{
	const struct path_vertex *x = r->x;
	if (i == r->edges)
		return 1;
	if (i == 0 && is_on_delta_emitter(c, &x[0]))
		return 0;
	if (i + 2 <= r->edges)
		return scattering_pdf(c, &x[i + 2], &x[i + 1], r->is_delta[i + 1], &x[i], TRANSPORT_RADIANCE) *
		       distance_factor(c, &x[i + 1], &x[i]);
	vec3 w = direction_to(&x[r->edges], &x[i]);
	double cosine = vec3_dot(c->w->camera.axes.n, w), pixels = c->window.width * c->window.height;
	return square(c->w->camera.pixels_per_slope) / (cosine * cosine * cosine * pixels) *
	       solid_angle_per_area(&x[r->edges], &x[i]) * distance_factor(c, &x[r->edges], &x[i]);
}

/* Returns false if double precision cannot decide: two points almost coincide, or are seen at a grazing angle. */
static bool is_well_conditioned(const struct route *r)
{
	for (unsigned i = 0; i < r->edges; i++) {
		const struct path_vertex *a = &r->x[i], *b = &r->x[i + 1];
		vec3 w = direction_to(a, b);
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

static double relative_difference(double a, double b)
{
	return a == b ? 0 : fabs(a - b) / fmax(fabs(a), fabs(b));
}

/* Assembles the path that technique s made. */
static void assemble_route(const struct path_context *c, unsigned s, unsigned t, const struct path_vertex *light,
			   struct route *r)
{
	*r = (struct route){.edges = s + t - 1};
	for (unsigned i = 0; i < s; i++)
		r->x[i] = light[i];
	for (unsigned i = 0; i < t; i++)
		r->x[r->edges - i] = c->camera[i];
	for (unsigned i = 1; i < r->edges; i++)
		r->is_delta[i] = r->x[i].is_delta && i + 1 != s && i != s;
}

static void compute_densities(const struct path_context *c, struct route *r)
{
	for (unsigned i = 0; i <= r->edges; i++) {
		r->pdf_from_light[i] = density_from_light(c, r, i);
		r->pdf_from_camera[i] = density_from_camera(c, r, i);
	}
}

/* At the distances and cosines allowed, directions between points are off by 1e-13, which lobes as narrow as alpha
 * 0.1 amplify by 1e3. A hit that Embree's floats place just beside its triangle is moved by up to 1e-7 off the ray,
 * which is rare and is counted. */
static void check_equal(struct density_tally *tally, double a, double b)
{
	if (relative_difference(a, b) < 1e-9)
		tally->worst_error = fmax(tally->worst_error, relative_difference(a, b));
	else if (relative_difference(a, b) < 1e-5)
		tally->off_ray++;
	else
		fail_msg("%.12g is to be %.12g", a, b);
}

static void check_walk(const struct route *r, unsigned s, struct density_tally *tally)
{
	for (unsigned i = 0; i <= r->edges; i++) {
		bool light = i < s;
		double forward = light ? r->pdf_from_light[i] : r->pdf_from_camera[i],
		       reverse = light ? r->pdf_from_camera[i] : r->pdf_from_light[i];
		check_equal(tally, r->x[i].pdf, forward);
		/* The reverse density needs two more vertices of the same sub-path. */
		if (light ? i + 3 <= s : i >= s + 2 && i < r->edges)
			check_equal(tally, r->x[i].pdf_rev, reverse);
	}
}

/* Returns F of path.h's head comment; for a specular lobe, the factor before the delta distribution. */
static double scattering_factor(const struct path_context *c, const struct path_vertex *camera,
				const struct path_vertex *vertex, const struct path_vertex *light)
{
	if (vertex->kind == VERTEX_MEDIUM)
		return medium_scattering(&c->w->media[0], vertex->x.p, direction_to(vertex, camera), &c->wl).v[0] *
		       phase_eval(&c->w->media[0].phase, vertex->x.p, direction_to(vertex, camera),
				  direction_to(vertex, light));
	if (vertex->is_delta) {
		struct bsdf_sample s = specular_lobe(c, camera, vertex, light, TRANSPORT_RADIANCE);
		return s.f.v[0] * fabs(s.wi.z);
	}
	struct surface_point x;
	is_turned_from(vertex, camera, &x);
	struct bsdf_point p = world_bsdf_point(&x, &c->wl, TRANSPORT_RADIANCE);
	vec3 wo = direction_to(vertex, camera), wi = direction_to(vertex, light);
	spectrum f = vertex->bsdf->ops->eval(vertex->bsdf, &p, frame_to_local(&x.sh, wo), frame_to_local(&x.sh, wi));
	return f.v[0] * fabs(vec3_dot(x.sh.n, wi) / vec3_dot(x.ng, wi));
}

/* Checks, along a sub-path: beta x densities = source x product of F x product of G. */
static void check_beta(const struct path_context *c, const struct path_vertex *v, unsigned n,
		       struct density_tally *tally)
{
	double density = v[0].pdf, value;
	bool light = v[0].kind != VERTEX_CAMERA;
	vec3 w = direction_to(&v[0], &v[1]);
	if (light) {
		const struct emitter *em = &c->w->emitters[v[0].emitter];
		struct emitter_point p = make_emitter_point(&v[0]);
		value = em->ops->radiance(em, &p, w, &c->wl).v[0];
		double leaving = is_on_delta_emitter(c, &v[0]) ? 1 : fabs(vec3_dot(v[0].x.ng, w));
		value *= v[0].kind == VERTEX_INFINITE ? fabs(vec3_dot(v[1].x.ng, w))
						      : leaving * solid_angle_per_area(&v[0], &v[1]);
	} else {
		value = square(c->w->camera.pixels_per_slope) / pow(vec3_dot(c->w->camera.axes.n, w), 3) *
			solid_angle_per_area(&v[0], &v[1]);
	}
	for (unsigned i = 1; i < n; i++) {
		density *= v[i].pdf;
		value *= transmittance_between(c, &v[i - 1], &v[i]);
		check_equal(tally, v[i].beta.v[0] * density, value);
		tally->betas++;
		if (i + 1 == n)
			return;
		value *= light ? scattering_factor(c, &v[i + 1], &v[i], &v[i - 1])
			       : scattering_factor(c, &v[i - 1], &v[i], &v[i + 1]);
		value *= path_cosine(&v[i], direction_to(&v[i], &v[i + 1])) * solid_angle_per_area(&v[i], &v[i + 1]);
	}
}

/* Returns the first vertex from x_j on that technique j joins: light goes straight through those before it. */
static unsigned joined_vertex(const struct path_context *c, const struct route *r, unsigned j)
{
	while (c->w->effects.transparent_shadows && j < r->edges && r->is_delta[j] && (r->x[j].mode & BSDF_STRAIGHT))
		j++;
	return j;
}

/* Returns the density of x_0 as next event estimation draws it. */
static double direct_light_pdf(const struct path_context *c, const struct route *r)
{
	const struct emitter *em = &c->w->emitters[r->x[0].emitter];
	struct emitter_point p = make_emitter_point(&r->x[0]);
	vec3 lit_point = r->x[joined_vertex(c, r, 1)].x.p;
	return emitter_choice_density_ratio(c->w, lit_point, r->x[0].emitter, em, &p) *
	       emitter_pdf_toward(em, lit_point, &p);
}

static double surface_cosine(const struct path_vertex *v, vec3 w)
{
	bool has_normal = v->kind == VERTEX_SURFACE || (v->kind == VERTEX_EMITTER && vec3_length(v->x.ng) > 0);
	return has_normal ? fabs(vec3_dot(v->x.ng, w)) : 1;
}

static double geometry_term(const struct path_vertex *a, const struct path_vertex *b)
{
	vec3 w = direction_to(a, b), d = vec3_sub(a->x.p, b->x.p);
	bool is_infinite = a->kind == VERTEX_INFINITE || b->kind == VERTEX_INFINITE;
	return surface_cosine(a, w) * surface_cosine(b, w) / (is_infinite ? 1 : vec3_dot(d, d));
}

static bool can_join(const struct path_context *c, const struct route *r, unsigned j)
{
	if (j == 0)
		return !is_on_delta_emitter(c, &r->x[0]);
	unsigned end = joined_vertex(c, r, j);
	if (j == 1 && end == r->edges)
		return c->joins_emitters_to_lens && r->x[0].kind != VERTEX_INFINITE &&
		       !is_on_delta_emitter(c, &r->x[0]) &&
		       direct_light_pdf(c, r) >= PATH_LENS_DENSITY_RATIO *
							 (c->light_subpath_interval ? c->light_subpath_interval : 1) *
							 path_pdf(c, NULL, &r->x[end], &r->x[0], TRANSPORT_RADIANCE);
	return !r->is_delta[j - 1] && !r->is_delta[end];
}

/* Returns the logarithm of the density of the whole path by technique j. Vertices that light passes straight follow
 * from the ends: the geometry terms of the small edges replace the long one's. */
static double log_technique_pdf(const struct path_context *c, const struct route *r, unsigned j)
{
	unsigned end = j > 0 ? joined_vertex(c, r, j) : 0;
	double sum = 0;
	for (unsigned i = 0; i < j; i++)
		sum += log(r->pdf_from_light[i]);
	for (unsigned i = end; i <= r->edges; i++)
		sum += log(r->pdf_from_camera[i]);
	for (unsigned i = j; i <= end && end > j; i++)
		sum += log(geometry_term(&r->x[i], &r->x[i - 1]));
	if (end > j)
		sum -= log(geometry_term(&r->x[end], &r->x[j - 1]));
	if (j != 1)
		return sum;
	return sum - log(r->pdf_from_light[0]) + log(direct_light_pdf(c, r));
}

/* Returns the edge between two points, as a sub-path makes it. */
static struct path_edge make_edge(const struct path_context *c, const struct path_vertex *a,
				  const struct path_vertex *b)
{
	struct path_edge e = {.medium = 1, .previous_medium = 1, .has_matching_media = true, .d = direction_to(a, b)};
	spectrum depth = optical_depth(c, a, b);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		e.scattering_transmittance.v[i] = exp(-depth.v[i]);
	return e;
}

/* Relabels the path as if technique s had made it. */
static void relabel_vertices(const struct path_context *c, struct route *r, unsigned s, struct joined_path *p,
			     struct path_edge *joint)
{
	p->edges = r->edges;
	p->light_count = s;
	p->passed_count = s > 0 ? joined_vertex(c, r, s) - s : 0;
	p->mismatched_edge = 0;
	p->joint_vertices = joint;
	for (unsigned i = 1; i <= r->edges && c->w->effects.scattering; i++) {
		struct path_edge *edge = i == s ? joint : i < s ? &r->x[i].edge : &r->x[i - 1].edge;
		*edge = make_edge(c, &r->x[i], &r->x[i - 1]);
	}
	for (unsigned i = 0; i <= r->edges; i++) {
		struct path_vertex *v = &r->x[i];
		v->is_delta = r->is_delta[i];
		v->pdf = i < s ? r->pdf_from_light[i] : r->pdf_from_camera[i];
		/* The sub-path does not reach far enough to know this. */
		v->pdf_rev = NAN;
		if (i + 3 <= s || i >= s + p->passed_count + 2)
			v->pdf_rev = i < s ? r->pdf_from_camera[i] : r->pdf_from_light[i];
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
	c->light_subpath_interval = 8;
	bool is_made = can_join(c, r, p->light_count);
	for (unsigned j = 0; j <= p->edges; j++)
		if (can_join(c, r, j))
			sum += j < (joined_vertex(c, r, 1) == p->edges ? 1 : 2) ? ratio[j] : 0.125 * ratio[j];
	double weight = is_made ? path_balance_weight(c, p, PATH_EDGES_MAX) : 1 / sum;
	c->light_subpath_interval = 1;
	if (!(relative_difference(weight, 1 / sum) < 1e-12))
		fail_msg("made by %u of %u, light in one of eight: weight %.12g, not %.12g", p->light_count, p->edges,
			 weight, 1 / sum);
}

static void check_ratios(struct path_context *c, struct route *r, struct density_tally *tally)
{
	double p[DEPTH_MAX + 2], ratio[DEPTH_MAX + 2], max_log_pdf = -INFINITY;
	for (unsigned j = 0; j <= r->edges; j++) {
		p[j] = log_technique_pdf(c, r, j);
		max_log_pdf = fmax(max_log_pdf, p[j]);
		if (!can_join(c, r, j))
			p[j] = -INFINITY;
	}
	for (unsigned s = 0; s <= r->edges; s++) {
		struct joined_path joined;
		struct path_edge joint;
		/* Techniques whose density is 1e100 times smaller than that of another never make the path. */
		if (!can_join(c, r, s) || max_log_pdf - p[s] > 230)
			continue;
		relabel_vertices(c, r, s, &joined, &joint);
		tally->with_passed_vertices += joined.passed_count > 0;
		for (unsigned max_s = s > 1 ? PATH_EDGES_MAX : 1; max_s <= PATH_EDGES_MAX;
		     max_s += PATH_EDGES_MAX - 1) {
			path_technique_ratios(c, &joined, max_s, ratio);
			double sum = 0;
			for (unsigned j = 0; j <= r->edges; j++) {
				double expected = j <= max_s ? exp(p[j] - p[s]) : 0;
				sum += expected;
				if (!(relative_difference(ratio[j], expected) < 1e-9))
					fail_msg("technique %u of %u edges, made by %u: %.12g instead of %.12g", j,
						 r->edges, s, ratio[j], expected);
				tally->worst_ratio_error =
					fmax(tally->worst_ratio_error, relative_difference(ratio[j], expected));
			}
			double weight = path_balance_weight(c, &joined, max_s);
			if (!(relative_difference(weight, 1 / sum) < 1e-9))
				fail_msg("made by %u of %u, up to %u: weight %.12g, not %.12g", s, r->edges, max_s,
					 weight, 1 / sum);
		}
		check_rare_light(c, r, &joined, ratio); /* for all techniques */
		tally->relabelled++;
	}
}

static bool can_join_subpaths(struct path_context *c, unsigned s, unsigned t)
{
	const struct path_vertex *z = &c->camera[t - 1];
	if (s == 0)
		return z->emitter >= 0 && vec3_dot(z->x.ng, z->to_prev) > 0;
	if (z->kind == VERTEX_INFINITE)
		return false;
	const struct path_vertex *y = &c->light[s - 1];
	vec3 w = direction_to(z, y);
	double film[2];
	struct camera moved_camera;
	if (t == 1 && !camera_project(world_camera_at(c->w, &z->x, &moved_camera), z->x.p, w, 1, &film[0], &film[1]))
		return false;
	if (t > 1 && spectrum_is_zero(path_scatter(c, z, z->to_prev, w)))
		return false;
	if (s > 1)
		return !spectrum_is_zero(path_scatter(c, y, vec3_neg(w), y->to_prev));
	const struct emitter *em = &c->w->emitters[y->emitter];
	struct emitter_point p = make_emitter_point(y);
	return !spectrum_is_zero(em->ops->radiance(em, &p, vec3_neg(w), &c->wl));
}

static void check_route(struct path_context *c, unsigned s, unsigned t, struct density_tally *tally)
{
	struct route r;
	assemble_route(c, s, t, c->light, &r);
	if (!is_well_conditioned(&r)) {
		tally->skipped++;
		return;
	}
	compute_densities(c, &r);
	check_walk(&r, s, tally);
	tally->routes++;
	tally->from_infinity += r.x[0].kind == VERTEX_INFINITE;
	for (unsigned i = 0; i <= r.edges; i++)
		if (r.is_delta[i]) {
			tally->with_delta++;
			break;
		}
	check_ratios(c, &r, tally);
}

/* A vertex that is joined to the camera must land where the film sees it from this x_k. */
static void check_film_position(struct path_context *c, unsigned s)
{
	double film[2];
	if (spectrum_is_zero(path_connect(c, s, 1, PATH_EDGES_MAX, film)))
		return;
	struct camera moved_camera;
	vec3 w = camera_direction(world_camera_at(c->w, &c->camera[0].x, &moved_camera), c->camera[0].x.p, film[0],
				  film[1]);
	assert_true(vec3_length(vec3_sub(w, direction_to(&c->camera[0], &c->light[s - 1]))) < 1e-12);
}

struct density_tally density_check(const char *name, struct world *w, size_t walks)
{
	static struct path_context c;
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct density_tally tally = {0};
	c = (struct path_context){.w = w,
				  .window = {-1, -1, w->settings.width + 2.0, w->settings.height + 2.0},
				  .min_depth = 1,
				  .max_depth = DEPTH_MAX,
				  .counters = counters};
	for (uint64_t i = 0; i < dice_scaled_count(walks); i++) {
		struct sampler_random s;
		double film[2];
		sampler_random_init(&s, stats_seed(name), RNG_TEST, i, 0);
		/* On such a large film, emitters are small enough to be joined to the lens. */
		c.joins_emitters_to_lens = i % 4 == 1;
		const double border = c.joins_emitters_to_lens ? 10.0 * w->settings.width : 1;
		c.window = (struct film_window){-border, -border, w->settings.width + 2 * border,
						w->settings.height + 2 * border};
		unsigned camera = path_walk_camera(&c, &s.base, DEPTH_MAX + 1, film);
		unsigned light = path_walk_light(&c, &s.base, DEPTH_MAX);
		struct route subpath;
		if (camera > 1) {
			assemble_route(&c, 0, camera, NULL, &subpath);
			if (is_well_conditioned(&subpath))
				check_beta(&c, c.camera, camera, &tally);
		}
		if (light > 1) {
			assemble_route(&c, light, 1, c.light, &subpath);
			if (is_well_conditioned(&subpath))
				check_beta(&c, c.light, light, &tally);
		}
		for (unsigned j = 2; j <= light; j++)
			check_film_position(&c, j);
		for (unsigned t = 1; t <= camera; t++)
			for (unsigned j = t > 1			     ? 0
					  : c.joins_emitters_to_lens ? 1
								     : 2;
			     j <= light && t + j - 1 <= DEPTH_MAX; j++)
				if (t + j >= 2 && can_join_subpaths(&c, j, t))
					check_route(&c, j, t, &tally);
	}
	print_message(
		"%s: %zu paths (%zu with specular vertices, %zu from infinity, %zu too flat to tell), %zu relabelled\n",
		name, tally.routes, tally.with_delta, tally.from_infinity, tally.skipped, tally.relabelled);
	print_message("  worst: pdf and beta (of %zu vertices) %.1e, ratio %.1e; %zu off the ray\n", tally.betas,
		      tally.worst_error, tally.worst_ratio_error, tally.off_ray);
	assert_true(tally.off_ray <= tally.routes / 200 + 10);
	assert_true(tally.routes > dice_scaled_count(walks) && 5 * tally.relabelled > 7 * tally.routes);
	world_free(w);
	return tally;
}
