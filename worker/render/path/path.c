/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Sub-paths from the camera and from the emitters, the densities with which they are made, and the film's splats.
 *
 * path_walk_camera and path_walk_light draw the first vertex and its direction, then continue_subpath draws one
 * direction after another from the BSDFs, with Russian roulette where it is allowed. Each vertex keeps its throughput
 * (beta) and its densities per area from both sides, pdf and pdf_rev, from which multiple importance sampling takes its
 * weights (Veach 1997). A vertex at infinity stands for a direction; its density is per solid angle. A sub-path ends
 * early where a ray finds nothing, a density is zero, or shading and geometric normal disagree about a direction's
 * side.
 *
 * Failures: nothing here can fail as a whole. A contribution that is NaN, infinite or negative, or that makes the
 * sample brighter than a float holds, is left out and counted (COUNT_NAN, COUNT_INFINITE, COUNT_NEGATIVE); notes of the
 * image say how many were. Without a count, contributions fainter than INTENSITY_MIN are left out, and those of a
 * sample beyond PATH_SPLATS_MAX.
 */
#include "worker/render/path/path.h"

#include "worker/render/path/measure.h"
#include "worker/render/path/media.h"

#include <float.h>
#include <string.h>

/* Fainter contributions are taken as black: their parts, such as those of path classes, could be denormal, so that they
 * would not add up to the whole. */
#define INTENSITY_MIN (DBL_MIN / DBL_EPSILON)

struct film_window film_window_from_plan(const struct plan *p)
{
	return (struct film_window){(double)p->crop_x - p->border, (double)p->crop_y - p->border,
				    (double)p->crop_width + 2.0 * p->border, (double)p->crop_height + 2.0 * p->border};
}

void path_context_init_for_samples(struct path_context *c, const struct world *w, const struct plan *p,
				   uint64_t *counters)
{
	*c = (struct path_context){.w = w,
				   .window = film_window_from_plan(p),
				   .min_depth = p->min_depth,
				   .max_depth = p->max_depth,
				   .max_survival = PATH_SURVIVAL_MAX,
				   .skips_classes = true,
				   .counters = counters};
}

const struct surface_point *path_bent_point_facing_camera(const struct path_vertex *v, vec3 to_camera,
							  struct surface_point *turned)
{
	if (v->bsdf->has_delta || path_sides_agree(&v->x, to_camera))
		return &v->x;
	*turned = v->x;
	surface_flip_relief(turned);
	return path_sides_agree(turned, to_camera) ? turned : &v->x;
}

spectrum path_scatter(const struct path_context *c, const struct path_vertex *v, vec3 to_camera, vec3 to_light)
{
	struct surface_point turned;
	if (v->kind == VERTEX_MEDIUM)
		return path_scatter_in_medium(c->w, &c->wl, v, to_camera, to_light);
	const struct surface_point *x = path_point_facing_camera(v, to_camera, &turned);
	if (!v->bsdf->has_smooth || !path_sides_agree(x, to_camera) || !path_sides_agree(x, to_light))
		return spectrum_constant(0);
	struct bsdf_point p = world_bsdf_point(x, &c->wl, TRANSPORT_RADIANCE);
	vec3 wo = frame_to_local(&x->sh, to_camera), wi = frame_to_local(&x->sh, to_light);
	spectrum f = v->bsdf->ops->eval(v->bsdf, &p, wo, wi);
	return spectrum_scale(fabs(wi.z) / fabs(vec3_dot(v->x.ng, to_light)), f);
}

/* Returns the surface point with which a sub-path that comes from `from` samples v. A sub-path from the
 * light never turns a normal. */
static const struct surface_point *sampling_point(const struct path_vertex *v, vec3 from, enum transport transport,
						  struct surface_point *turned)
{
	return transport == TRANSPORT_RADIANCE ? path_point_facing_camera(v, from, turned) : &v->x;
}

static double surface_pdf(const struct path_context *c, const struct path_vertex *v, vec3 wo, vec3 wi,
			  enum transport transport)
{
	struct surface_point turned;
	const struct surface_point *x = sampling_point(v, wo, transport, &turned);
	if (!v->bsdf->has_smooth || !path_sides_agree(x, wo) || !path_sides_agree(x, wi))
		return 0;
	struct bsdf_point p = world_bsdf_point(x, &c->wl, transport);
	return v->bsdf->ops->pdf_solid(v->bsdf, &p, frame_to_local(&x->sh, wo), frame_to_local(&x->sh, wi));
}

static double disk_pdf(const struct world *w)
{
	return 1 / (M_PI * w->radius * w->radius);
}

double path_pdf(const struct path_context *c, const struct path_vertex *prev, const struct path_vertex *vertex,
		const struct path_vertex *next, enum transport transport)
{
	double distance2, solid = 0;
	vec3 omega = path_direction(vertex, next, &distance2);
	if (!(distance2 > 0) || !path_can_be_hit(c, next) || !path_ray_can_meet(omega, next))
		return 0;
	if (vertex->kind == VERTEX_INFINITE)
		return disk_pdf(c->w) * (next->kind == VERTEX_MEDIUM ? 1 : jac_disk_from_area(next->x.ng, omega));
	if (vertex->kind == VERTEX_CAMERA) {
		struct camera storage;
		solid = camera_jac_film_from_solid(world_camera_at(c->w, &vertex->x, &storage), omega) /
			(c->window.width * c->window.height);
	} else if (vertex->kind == VERTEX_EMITTER || !prev) {
		struct emitter_point p = world_emitter_point(&vertex->x);
		struct emitter_storage storage;
		const struct emitter *em = world_emitter_at(c->w, vertex->emitter, vertex->x.prim.time, &storage);
		solid = em->ops->pdf_direction(em, &p, omega);
	} else {
		double unused;
		vec3 back = path_direction(vertex, prev, &unused);
		solid = vertex->kind == VERTEX_MEDIUM
				? phase_eval(&path_medium(c->w, vertex->edge.medium)->phase, vertex->x.p, back, omega)
				: surface_pdf(c, vertex, back, omega, transport);
	}
	return next->kind == VERTEX_INFINITE ? solid : solid * path_jac_solid_from_vertex(next, omega, distance2);
}

/* Traces to the next vertex. u in [0,1) draws the distance where media scatter; *transmittance is then set to
 * that of the edge. */
static bool trace_next(struct path_context *c, const struct path_vertex *vertex, vec3 d, double t_min, double t_max,
		       double u, struct path_vertex *to, spectrum *transmittance)
{
	return EFFECT_IS_ON(c->w, scattering)
		       ? path_extend_in_media(c, vertex, d, t_min, t_max, u, NULL, to, transmittance)
		       : path_extend(c, vertex, d, t_min, t_max, to);
}

/* Like trace_next(), but for edge e of the camera's sub-path where media emit; beta is the throughput at its start.
 * Stores the light that is emitted along the edge in c->emission. */
static bool trace_next_emitting(struct path_context *c, struct sampler *s, unsigned e, spectrum beta, vec3 d,
				double t_min, double t_max, double u, spectrum *transmittance)
{
	struct path_vertex *vertex = &c->camera[e - 1];
	struct path_emission emission = {s->block(s, SIDE_LIGHT, e - 1)[DIM_EMISSION], spectrum_constant(0)};
	bool hit = path_extend_in_media(c, vertex, d, t_min, t_max, u, &emission, vertex + 1, transmittance);
	c->emission[e] = spectrum_is_zero(emission.sum) ? emission.sum : spectrum_mul(beta, emission.sum);
	c->emission_edges = e;
	return hit;
}

/* How a sub-path leaves a vertex by its BSDF or phase function. */
struct departure {
	vec3 wi;
	spectrum beta;
	/* Densities per solid angle; for a delta lobe, the probability of choosing it. */
	double pdf, pdf_rev;
	double eta; /* refractive index on wi's side divided by that on the side of to_prev */
	unsigned mode;
	bool is_delta;
};

static bool sample_departure_in_medium(const struct path_context *c, const struct path_vertex *v, const double u[2],
				       struct departure *out)
{
	const struct medium *m = path_medium(c->w, v->edge.medium);
	*out = (struct departure){.eta = 1};
	out->wi = phase_sample(&m->phase, v->x.p, v->to_prev, u, &out->pdf);
	out->pdf_rev = m->phase.ops->eval_flakes ? phase_eval(&m->phase, v->x.p, out->wi, v->to_prev) : out->pdf;
	out->beta = spectrum_mul(v->beta, medium_scattering(m, v->x.p, v->to_prev, &c->wl));
	return out->pdf > 0;
}

double path_delta_probability(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode)
{
	vec3 wi;
	double probability;
	return spectrum_is_zero(bsdf_eval_delta(b, p, wo, mode, &wi, &probability)) ? 0 : probability;
}

spectrum path_delta_weight(const struct path_context *c, const struct path_vertex *v)
{
	double probability;
	vec3 wi;
	struct bsdf_point p = world_bsdf_point(&v->x, &c->wl, TRANSPORT_RADIANCE);
	spectrum weight =
		bsdf_eval_delta(v->bsdf, &p, frame_to_local(&v->x.sh, v->to_prev), v->mode, &wi, &probability);
	return spectrum_is_zero(weight) || !(probability > 0) ? spectrum_constant(0) : weight;
}

static bool sample_departure(const struct path_context *c, const struct path_vertex *v, const double u[3],
			     enum transport transport, struct departure *out)
{
	struct surface_point turned;
	if (v->kind == VERTEX_MEDIUM)
		return sample_departure_in_medium(c, v, u, out);
	const struct surface_point *x = sampling_point(v, v->to_prev, transport, &turned);
	struct bsdf_point p = world_bsdf_point(x, &c->wl, transport);
	struct bsdf_sample s;
	vec3 wo = frame_to_local(&x->sh, v->to_prev);
	bool sides_agree = path_sides_agree(x, v->to_prev);
	if (!(sides_agree || (v->bsdf->modes & BSDF_STRAIGHT)) || !v->bsdf->ops->sample(v->bsdf, &p, wo, u, &s) ||
	    !(s.pdf > 0))
		return false;
	out->wi = frame_to_world(&x->sh, s.wi);
	if (!(s.mode & BSDF_STRAIGHT) && !(sides_agree && path_sides_agree(x, out->wi)))
		return false;
	out->mode = s.mode;
	out->is_delta = (s.mode & BSDF_DELTA) != 0;
	double factor = fabs(s.wi.z);
	if (transport == TRANSPORT_IMPORTANCE)
		factor = fabs(wo.z) / fabs(vec3_dot(v->x.ng, v->to_prev)) * fabs(vec3_dot(v->x.ng, out->wi));
	out->beta = spectrum_scale(factor / s.pdf, spectrum_mul(v->beta, s.f));
	out->pdf = s.pdf;
	out->eta = s.eta;
	out->pdf_rev = 0;
	if (c->is_unidirectional || x == &turned)
		return true;
	struct bsdf_point reverse_point = world_bsdf_point(
		x, &c->wl, transport == TRANSPORT_RADIANCE ? TRANSPORT_IMPORTANCE : TRANSPORT_RADIANCE);
	if (!out->is_delta)
		out->pdf_rev = v->bsdf->ops->pdf_solid(v->bsdf, &reverse_point, s.wi, wo);
	else if (v->bsdf->is_nonreciprocal)
		out->pdf_rev = path_delta_probability(v->bsdf, &reverse_point, s.wi, s.mode);
	else
		out->pdf_rev = s.pdf;
	return true;
}

/* Returns the density of `to` (per area, per solid angle at infinity), reached from `vertex` by a direction of
 * density `solid` per solid angle. For a delta lobe, `solid` is a probability and per_solid turns it into a density:
 * see path_delta_densities. Otherwise per_solid is 1. */
static double vertex_pdf(const struct path_context *c, const struct path_vertex *vertex, const struct path_vertex *to,
			 double solid, double per_solid)
{
	double distance2;
	vec3 omega = path_direction(vertex, to, &distance2);
	if (!(distance2 > 0) || !path_can_be_hit(c, to) || !path_ray_can_meet(omega, to))
		return 0;
	double lobe = solid * per_solid;
	return to->kind == VERTEX_INFINITE ? lobe : lobe * path_jac_solid_from_vertex(to, omega, distance2);
}

void path_delta_densities(const struct surface_point *x, vec3 light, vec3 camera, double eta_camera, double *to_light,
			  double *to_camera)
{
	*to_light = fabs(vec3_dot(x->ng, light));
	*to_camera = *to_light * eta_camera * eta_camera * fabs(vec3_dot(x->sh.n, camera) / vec3_dot(x->sh.n, light));
}

static bool survives_roulette(const struct path_context *c, unsigned scatterings, double first_throughput, double u,
			      spectrum *beta)
{
	if (!(c->max_survival > 0) || scatterings < c->w->settings.roulette_depth)
		return true;
	double q = fmin(spectrum_max(*beta) / first_throughput, c->max_survival);
	if (!(u < q))
		return false;
	*beta = spectrum_scale(1 / q, *beta);
	return true;
}

/* Traces from vertex n - 1 of a sub-path to the next vertex, in a world with media. Sets *transmittance to
 * that of the edge where media scatter, otherwise to 1. */
static __attribute__((noinline)) bool trace_next_in_media(struct path_context *c, struct sampler *s,
							  enum sampler_side side, unsigned n,
							  const struct departure *out, double u,
							  spectrum *transmittance)
{
	struct path_vertex *v = side == SIDE_CAMERA ? c->camera : c->light;
	*transmittance = spectrum_constant(1);
	return EFFECT_IS_ON(c->w, medium_light) && side == SIDE_CAMERA
		       ? trace_next_emitting(c, s, n, out->beta, out->wi, 0, INFINITY, u, transmittance)
		       : trace_next(c, &v[n - 1], out->wi, 0, INFINITY, u, &v[n], transmittance);
}

/* Applies the media along the last edge to the throughput and the densities of its ends. */
static __attribute__((noinline)) void apply_media(struct path_context *c, enum sampler_side side, unsigned n, vec3 wi,
						  spectrum transmittance)
{
	struct path_vertex *v = side == SIDE_CAMERA ? c->camera : c->light, *vertex = &v[n - 1], *to = &v[n];
	if (EFFECT_IS_ON(c->w, scattering)) {
		path_apply_edge(c, to, transmittance);
		v[n - 2].pdf_rev *= path_edge_pdf(c, &vertex->edge, vertex->edge.previous_medium, &v[n - 2]);
	} else if (EFFECT_IS_ON(c->w, absorption) && side == SIDE_CAMERA) {
		path_absorb(c, vertex, wi, to);
	}
}

/* Extends v[0..n) up to `max` vertices by scattering and returns the new number of vertices; v[n-1] is not at infinity.
 * Roulette compares the throughput with `first_throughput`. */
static unsigned continue_subpath(struct path_context *c, struct sampler *s, enum sampler_side side,
				 struct path_vertex *v, unsigned n, unsigned max, double first_throughput)
{
	enum transport transport = side == SIDE_CAMERA ? TRANSPORT_RADIANCE : TRANSPORT_IMPORTANCE;
	for (;;) {
		struct path_vertex *vertex = &v[n - 1], *next = &v[n];
		const double *u = s->block(s, side, n - 1);
		struct departure out;
		for (int i = 0; i < 3; i++)
			vertex->next_event[i] = u[DIM_NEXT_EVENT + i];
		if (n >= max || !sample_departure(c, vertex, u + DIM_BSDF, transport, &out))
			return n;
		if (!survives_roulette(c, n - 1, first_throughput, u[DIM_ROULETTE], &out.beta) ||
		    spectrum_is_zero(out.beta))
			return n;
		spectrum transmittance;
		bool hit = EFFECT_IS_ON(c->w, media)
				   ? trace_next_in_media(c, s, side, n, &out, u[DIM_DISTANCE], &transmittance)
				   : path_extend(c, vertex, out.wi, 0, INFINITY, next);
		if (!hit || (next->kind == VERTEX_INFINITE && side == SIDE_LIGHT))
			return n;
		double forward_per_solid = 1, reverse_per_solid = 1;
		if (out.is_delta && side == SIDE_CAMERA)
			path_delta_densities(&vertex->x, out.wi, vertex->to_prev, 1 / out.eta, &forward_per_solid,
					     &reverse_per_solid);
		else if (out.is_delta)
			path_delta_densities(&vertex->x, vertex->to_prev, out.wi, out.eta, &reverse_per_solid,
					     &forward_per_solid);
		vertex->is_delta = out.is_delta;
		vertex->mode = out.mode;
		next->beta = out.beta;
		next->pdf = vertex_pdf(c, vertex, next, out.pdf, forward_per_solid);
		if (!c->is_unidirectional)
			v[n - 2].pdf_rev = vertex_pdf(c, vertex, &v[n - 2], out.pdf_rev, reverse_per_solid);
		if (EFFECT_IS_ON(c->w, media))
			apply_media(c, side, n, out.wi, transmittance);
		if (!(next->pdf > 0))
			return n;
		n++;
		if (next->kind == VERTEX_INFINITE)
			return n;
	}
}

/* Returns the time of both sub-paths, for u in [0,1). A rolling shutter exposes each line for a fraction of
 * the time, the first line from the beginning and the last until the end; points beyond the film's edge
 * belong to the nearest line. */
static double choose_time(const struct world *w, const double film[2], double u)
{
	const struct scene_settings *s = &w->settings;
	if (s->rolling_shutter == ROLL_NONE)
		return u;
	bool rows = s->rolling_shutter == ROLL_TOP || s->rolling_shutter == ROLL_BOTTOM;
	double line = rows ? film[1] / w->camera.height : film[0] / w->camera.width;
	line = fmin(fmax(line, 0), 1);
	if (s->rolling_shutter == ROLL_BOTTOM || s->rolling_shutter == ROLL_RIGHT)
		line = 1 - line;
	return fmin((1 - s->line_exposure) * line + s->line_exposure * u, 1 - 0x1p-53);
}

unsigned path_walk_camera(struct path_context *c, struct sampler *s, unsigned max_vertices, double film[2])
{
	const struct world *w = c->w;
	struct path_vertex *v = c->camera;
	const double *u = s->block(s, SIDE_CAMERA, 0);
	film[0] = c->window.x + u[DIM_FILM_X] * c->window.width;
	film[1] = c->window.y + u[DIM_FILM_Y] * c->window.height;
	c->wl = world_sample_wavelengths(w, u[DIM_WAVELENGTH]);
	c->time = EFFECT_IS_ON(w, motion) ? choose_time(w, film, s->block(s, SIDE_LIGHT, 0)[DIM_TIME]) : 0;
	v[0] = (struct path_vertex){.kind = VERTEX_CAMERA, .emitter = -1, .pdf = 1, .beta = spectrum_constant(1)};
	v[0].x.prim = prim_none_at(c->time);
	struct camera storage;
	const struct camera *camera = world_camera_at(w, &v[0].x, &storage);
	v[0].x.p = camera_sample_point(camera, u + DIM_APERTURE_U);
	v[0].edge.medium = w->camera_medium;
	c->emission_edges = 0;
	if (max_vertices < 2 || !camera_film_point_is_valid(&w->camera, film[0], film[1]))
		return 1;
	vec3 d = camera_direction(camera, v[0].x.p, film[0], film[1]);
	double t_min, t_max, area = c->window.width * c->window.height;
	camera_clip_range(camera, d, &t_min, &t_max);
	spectrum transmittance = spectrum_constant(1);
	double u_distance = u[DIM_CAMERA_DISTANCE];
	if (!(EFFECT_IS_ON(w, medium_light) ? trace_next_emitting(c, s, 1, spectrum_constant(area), d, t_min, t_max,
								  u_distance, &transmittance)
					    : trace_next(c, &v[0], d, t_min, t_max, u_distance, &v[1], &transmittance)))
		return 1;
	v[1].beta = spectrum_constant(area);
	v[1].pdf = path_pdf(c, NULL, &v[0], &v[1], TRANSPORT_RADIANCE);
	if (EFFECT_IS_ON(w, scattering))
		path_apply_edge(c, &v[1], transmittance);
	else if (EFFECT_IS_ON(w, absorption))
		path_absorb(c, &v[0], d, &v[1]);
	if (v[1].kind == VERTEX_INFINITE)
		return 2;
	if (!(v[1].pdf > 0))
		return 1;
	return continue_subpath(c, s, SIDE_CAMERA, v, 2, max_vertices, area);
}

/* The first step of a light sub-path that starts at infinity: it passes through a disk as wide as the world,
 * perpendicular to the direction. */
static bool leave_infinity(struct path_context *c, struct path_vertex *v, const double u[2], double distance,
			   spectrum *transmittance)
{
	const struct world *w = c->w;
	vec3 d = vec3_neg(v[0].x.p);
	struct frame f = frame_around(d);
	double r = w->radius * sqrt(u[0]), phi = 2 * M_PI * u[1];
	struct path_vertex start = {.kind = VERTEX_CAMERA};
	start.x.p = frame_to_world(&f, (vec3){r * cos(phi), r * sin(phi), -2 * w->radius});
	start.x.prim = prim_none_at(v[0].x.prim.time);
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(w, v[0].emitter, v[0].x.prim.time, &storage);
	struct emitter_point p = {.p = v[0].x.p, .is_infinite = true};
	spectrum l = em->ops->radiance(em, &p, d, &c->wl);
	if (!trace_next(c, &start, d, 0, INFINITY, distance, &v[1], transmittance) || v[1].kind == VERTEX_INFINITE)
		return false;
	v[1].beta = spectrum_scale(1 / disk_pdf(w), spectrum_mul(v[0].beta, l));
	return true;
}

static bool leave_surface(struct path_context *c, struct path_vertex *v, const double u[2], double distance,
			  spectrum *transmittance)
{
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(c->w, v[0].emitter, v[0].x.prim.time, &storage);
	struct emitter_point p = world_emitter_point(&v[0].x);
	vec3 d;
	double solid;
	if (!em->ops->sample_direction(em, &p, u, &d, &solid) || !(solid > 0))
		return false;
	spectrum l = em->ops->radiance(em, &p, d, &c->wl);
	if (!trace_next(c, &v[0], d, 0, INFINITY, distance, &v[1], transmittance) || v[1].kind == VERTEX_INFINITE)
		return false;
	v[1].beta = spectrum_scale(path_cosine(&v[0], d) / solid, spectrum_mul(v[0].beta, l));
	return true;
}

unsigned path_walk_light(struct path_context *c, struct sampler *s, unsigned max_vertices)
{
	const struct world *w = c->w;
	struct path_vertex *v = c->light;
	const double *u = s->block(s, SIDE_LIGHT, 0);
	int32_t chosen = world_pick_emitter(w, u[DIM_EMITTER_CHOICE]);
	if (chosen < 0 || max_vertices == 0)
		return 0;
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(w, chosen, c->time, &storage);
	struct emitter_point p;
	double pdf;
	if (!em->ops->sample_point(em, u + DIM_EMITTER_POINT, &p, &pdf) || !(pdf > 0))
		return 0;
	pdf *= w->emitter_pdf[chosen];
	v[0] = path_emitter_vertex(w, chosen, &p, c->time);
	v[0].pdf = pdf;
	v[0].beta = spectrum_constant(1 / pdf);
	if (max_vertices < 2)
		return 1;
	spectrum transmittance = spectrum_constant(1);
	bool leaves = p.is_infinite ? leave_infinity(c, v, u + DIM_EMITTER_DIRECTION, u[DIM_DISTANCE], &transmittance)
				    : leave_surface(c, v, u + DIM_EMITTER_DIRECTION, u[DIM_DISTANCE], &transmittance);
	if (!leaves || spectrum_is_zero(v[1].beta))
		return 1;
	v[1].pdf = path_pdf(c, NULL, &v[0], &v[1], TRANSPORT_IMPORTANCE);
	if (EFFECT_IS_ON(w, scattering))
		path_apply_edge(c, &v[1], transmittance);
	if (!(v[1].pdf > 0))
		return 1;
	return continue_subpath(c, s, SIDE_LIGHT, v, 2, max_vertices, spectrum_max(v[1].beta));
}

unsigned path_continue_walk(struct path_context *c, struct sampler *s, enum sampler_side side, unsigned n,
			    unsigned max_vertices)
{
	struct path_vertex *v = side == SIDE_CAMERA ? c->camera : c->light;
	if (side == SIDE_CAMERA)
		c->emission_edges = n - 1;
	return continue_subpath(c, s, side, v, n, max_vertices, spectrum_max(v[1].beta));
}

/* Whether all lanes are +0 or positive and finite, without a comparison that would trap on NaN.
 * *zero: all lanes are +0. */
static bool is_finite_nonnegative(const spectrum *l, bool *zero)
{
	const uint64_t exponent_one = UINT64_C(1) << 52;
	uint64_t any_bits = 0, sign = 0;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		uint64_t bits;
		memcpy(&bits, &l->v[i], sizeof bits);
		any_bits |= bits;
		sign |= bits | (bits + exponent_one);
	}
	*zero = any_bits == 0;
	return sign >> 63 == 0;
}

bool path_accept(const struct path_context *c, spectrum l)
{
	bool zero;
	if (is_finite_nonnegative(&l, &zero))
		return !zero;
	zero = true;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		if (isnan(l.v[i])) {
			c->counters[COUNT_NAN]++;
			return false;
		}
		if (isinf(l.v[i])) {
			c->counters[COUNT_INFINITE]++;
			return false;
		}
		if (l.v[i] < 0) {
			c->counters[COUNT_NEGATIVE]++;
			return false;
		}
		zero = zero && l.v[i] == 0;
	}
	return !zero;
}

static void to_xyz(const struct path_context *c, spectrum l, double xyz[3])
{
	if (EFFECT_IS_ON(c->w, colour)) {
		spectrum_to_xyz(l, &c->wl, xyz);
		return;
	}
	for (int i = 0; i < 3; i++)
		xyz[i] = l.v[0] * c->w->grey_xyz[i];
}

double path_intensity(const struct path_context *c, spectrum l)
{
	double xyz[3];
	to_xyz(c, l, xyz);
	return xyz[0] + xyz[1] + xyz[2];
}

bool path_sample_add_splat(struct path_context *c, struct path_sample *out, double x, double y, spectrum l)
{
	if (!path_accept(c, l) || out->splat_count == PATH_SPLATS_MAX)
		return false;
	struct splat *s = &out->splats[out->splat_count];
	s->x = x;
	s->y = y;
	to_xyz(c, l, s->xyz);
	double sum = s->xyz[0] + s->xyz[1] + s->xyz[2];
	if (out->intensity + sum > (double)FLT_MAX) {
		c->counters[COUNT_INFINITE]++;
		return false;
	}
	if (sum < INTENSITY_MIN)
		return false;
	out->intensity += sum;
	out->splat_count++;
	return true;
}
