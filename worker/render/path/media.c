/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Edges through scattering media are walked from one face of `null` on the ray to the next: walk_advance accumulates
 * optical depths, walk_cross_face enters the medium behind the face. path_extend_in_media ends where the depth at
 * one wavelength reaches the depth that was drawn, or at the first hit that is not such a face;
 * path_is_visible_in_media ends at the other vertex.
 *
 * Faces whose shapes state no medium are passed like all others. After PATH_NULL_FACES_MAX faces, as can happen between
 * faces that coincide, a ray counts as a miss and two vertices do not see each other.
 */
#include "worker/render/path/media.h"

#include "worker/render/path/visible.h"

/* Sets *medium to the medium on the side of `away` if the shape at x states media. Returns false if it states none. */
static bool find_side_medium(const struct world *w, const struct surface_point *x, vec3 away, uint32_t *medium)
{
	return world_medium_of_side(&w->shape_bindings[x->prim.shape], vec3_dot(x->ng, away) > 0, medium);
}

uint32_t path_medium_after(const struct world *w, const struct path_vertex *v, uint32_t medium, vec3 away)
{
	if (v->kind == VERTEX_SURFACE)
		find_side_medium(w, &v->x, away, &medium);
	return medium;
}

uint32_t path_medium_of_emitter(const struct world *w, const struct path_vertex *v, vec3 away)
{
	uint32_t medium = v->kind == VERTEX_INFINITE ? 0 : w->emitter_media[v->emitter];
	if (v->x.prim.shape < w->shape_count)
		find_side_medium(w, &v->x, away, &medium);
	return medium;
}

spectrum path_transmittance(const struct world *w, const struct wavelengths *wl, uint32_t medium,
			    const struct path_vertex *a, const struct path_vertex *b)
{
	if (!medium)
		return spectrum_constant(1);
	bool backwards = b->kind == VERTEX_CAMERA || a->kind == VERTEX_INFINITE;
	const struct path_vertex *from = backwards ? b : a, *to = backwards ? a : b;
	double distance2;
	vec3 d = path_direction(from, to, &distance2);
	bool at_infinity = to->kind == VERTEX_INFINITE;
	const struct medium_lanes m = medium_lanes_along(path_medium(w, medium), d, wl);
	const struct grid_ray r = {from->x.p, d, path_ray_t_min(w, from, d), at_infinity ? INFINITY : sqrt(distance2)};
	return spectrum_transmittance(medium_optical_depth(&m, &r));
}

void path_absorb(const struct path_context *c, const struct path_vertex *vertex, vec3 wi, struct path_vertex *to)
{
	to->edge.medium = path_medium_after(c->w, vertex, vertex->edge.medium, wi);
	to->beta = spectrum_mul(to->beta, path_transmittance(c->w, &c->wl, to->edge.medium, vertex, to));
}

spectrum path_absorb_weight(const struct path_context *c, const struct path_vertex *vertex, vec3 wi, spectrum weight,
			    struct path_vertex *to)
{
	if (!EFFECT_IS_ON(c->w, absorption))
		return weight;
	to->beta = weight;
	path_absorb(c, vertex, wi, to);
	return to->beta;
}

/* The state of a ray on its way through media. */
struct media_walk {
	/* `medium` is the medium where the ray is; `scattering_transmittance` is set at the end. */
	struct path_edge *edge;
	vec3 d; /* direction of the ray */
	/* Optical depths so far: of all media, and of those that scatter. */
	spectrum depth, event_depth;
	struct medium_lanes lanes; /* coefficients of the medium where the ray is, if any */
	bool scatters;		   /* the medium where the ray is scatters */
	/* The medium where the ray is, if it emits and emission is wanted; otherwise NULL. */
	const struct medium *emitting_medium;
	struct path_emission *emission; /* NULL: emission is not wanted */
	const struct wavelengths *wl;
};

static void walk_enter_medium(const struct path_context *c, struct media_walk *k, uint32_t medium)
{
	k->edge->medium = medium;
	k->scatters = medium && path_medium(c->w, medium)->is_scattering;
	k->emitting_medium = NULL;
	if (!medium)
		return;
	const struct medium *m = path_medium(c->w, medium);
	k->lanes = medium_lanes_along(m, k->d, &c->wl);
	k->emitting_medium = k->emission && m->is_emissive ? m : NULL;
}

static struct media_walk walk_begin(const struct path_context *c, const struct path_vertex *vertex, vec3 d,
				    struct path_edge *edge, struct path_emission *emission)
{
	bool is_emitter = vertex->kind == VERTEX_EMITTER || vertex->kind == VERTEX_INFINITE;
	uint32_t medium = is_emitter ? path_medium_of_emitter(c->w, vertex, d)
				     : path_medium_after(c->w, vertex, vertex->edge.medium, d);
	struct media_walk k = {.edge = edge,
			       .d = d,
			       .depth = spectrum_constant(0),
			       .event_depth = spectrum_constant(0),
			       .emission = emission,
			       .wl = &c->wl};
	*edge = (struct path_edge){.previous_medium = medium, .has_matching_media = true, .d = d};
	walk_enter_medium(c, &k, medium);
	return k;
}

static void walk_add_depth(struct media_walk *k, spectrum depth)
{
	k->depth = spectrum_add(k->depth, depth);
	k->event_depth = k->scatters ? spectrum_add(k->event_depth, depth) : k->event_depth;
}

/* Adds the optical depth between t0 and t1 on the ray from o. */
static void walk_advance(struct media_walk *k, vec3 o, double t0, double t1)
{
	if (k->edge->medium)
		walk_add_depth(k, medium_optical_depth(&k->lanes, &(struct grid_ray){o, k->d, t0, t1}));
}

/* Returns the light that reaches the start of a segment of that length with constant emission l per length. */
static spectrum homogeneous_emission(const struct medium_lanes *m, spectrum l, double length)
{
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double sigma = m->sigma_t[0].v[i];
		if (l.v[i] > 0) /* avoids 0 times infinity */
			l.v[i] *= sigma > 0 ? -expm1(-sigma * length) / sigma : length;
	}
	return l;
}

/* Adds the light that the medium emits between t0 and t1 along the ray, a segment that the edge crosses entirely.
 * Without events and in a homogeneous medium it is known in closed form; otherwise it is estimated at one point. The
 * light is divided by the probability that the edge gets this far, which is the mean over the wavelengths of
 * exp(-depth) of the media that scatter. */
static void walk_add_emission(struct media_walk *k, vec3 o, double t0, double t1)
{
	const struct emission *g = &k->emitting_medium->emission;
	spectrum l, segment_depth = spectrum_constant(0), all, events = k->event_depth;
	if (!g->radiance.grid && !k->lanes.grid && !k->scatters) {
		l = homogeneous_emission(&k->lanes, emission_constant(g, k->wl), t1 - t0);
	} else {
		double t;
		if (!emission_sample(g, &(struct grid_ray){o, k->d, t0, t1}, k->emission->u, k->wl, &t, &l))
			return;
		segment_depth = medium_optical_depth(&k->lanes, &(struct grid_ray){o, k->d, t0, t});
	}
	all = spectrum_transmittance(spectrum_add(k->depth, segment_depth));
	events = spectrum_transmittance(k->scatters ? spectrum_add(events, segment_depth) : events);
	l = spectrum_scale(1 / spectrum_mean(events), spectrum_mul(l, all));
	k->emission->sum = spectrum_add(k->emission->sum, l);
}

/* Like walk_advance(), but stops at the event where the depth at wavelength `lane` reaches `depth`, and adds emission.
 * Returns the distance of the event; INFINITY if there is none before t1. depth = INFINITY: no events. */
static double walk_to_event(struct media_walk *k, vec3 o, double t0, double t1, int lane, double depth)
{
	spectrum segment_depth;
	if (!k->scatters || depth == INFINITY) {
		if (k->emitting_medium && t1 > t0)
			walk_add_emission(k, o, t0, t1);
		walk_advance(k, o, t0, t1);
		return INFINITY;
	}
	double t = medium_invert_depth(&k->lanes, &(struct grid_ray){o, k->d, t0, t1}, lane,
				       fmax(depth - k->event_depth.v[lane], 0), &segment_depth);
	if (k->emitting_medium && fmin(t, t1) > t0)
		walk_add_emission(k, o, t0, fmin(t, t1));
	walk_add_depth(k, segment_depth);
	return t;
}

/* Passes through a face of `null` at x. */
static void walk_cross_face(const struct path_context *c, struct media_walk *k, const struct surface_point *x)
{
	uint32_t near_medium, far_medium;
	if (!find_side_medium(c->w, x, vec3_neg(k->d), &near_medium) || !find_side_medium(c->w, x, k->d, &far_medium))
		return;
	k->edge->has_matching_media = k->edge->has_matching_media && near_medium == k->edge->medium;
	walk_enter_medium(c, k, far_medium);
}

static spectrum walk_end(struct media_walk *k)
{
	k->edge->scattering_transmittance = spectrum_transmittance(k->event_depth);
	return spectrum_transmittance(k->depth);
}

static bool is_null_face(const struct world *w, const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && w->shape_bindings[v->x.prim.shape].is_null_face;
}

void path_make_medium_vertex(struct path_vertex *to, const struct path_vertex *from, double distance, vec3 d)
{
	to->kind = VERTEX_MEDIUM;
	to->emitter = -1;
	to->bsdf = NULL;
	to->x = (struct surface_point){.p = vec3_madd(from->x.p, distance, d), .prim = prim_none_at(from->x.prim.time)};
}

/* Traces to the event where the depth at wavelength `lane` reaches `depth`; INFINITY: no events. */
static bool trace_edge(struct path_context *c, const struct path_vertex *vertex, vec3 d, double t_min, double t_max,
		       int lane, double depth, struct path_emission *emission, struct path_vertex *to,
		       spectrum *transmittance)
{
	struct path_edge edge;
	struct media_walk k = walk_begin(c, vertex, d, &edge, emission);
	struct path_vertex from = *vertex;
	for (int i = 0; i < PATH_NULL_FACES_MAX; i++) {
		bool hit = path_extend(c, &from, d, t_min, t_max, to);
		double end = hit && to->kind == VERTEX_SURFACE ? vec3_length(vec3_sub(to->x.p, from.x.p)) : INFINITY;
		double event = walk_to_event(&k, from.x.p, t_min, fmin(end, t_max), lane, depth);
		if (event < INFINITY) {
			path_make_medium_vertex(to, &from, event, d);
			hit = vec3_is_finite(to->x.p);
		} else if (end > t_max) {
			walk_advance(&k, from.x.p, t_max, end);
		}
		if (!hit || !is_null_face(c->w, to)) {
			*transmittance = walk_end(&k);
			to->edge = edge;
			return hit;
		}
		walk_cross_face(c, &k, &to->x);
		from = *to;
		t_max -= end;
		t_min = 0;
	}
	return false;
}

bool path_extend_in_media(struct path_context *c, const struct path_vertex *vertex, vec3 d, double t_min, double t_max,
			  double u, struct path_emission *emission, struct path_vertex *to, spectrum *transmittance)
{
	double scaled_u = u * SPECTRUM_LANES, lane = floor(scaled_u);
	return trace_edge(c, vertex, d, t_min, t_max, (int)lane, -log1p(lane - scaled_u), emission, to, transmittance);
}

bool path_extend_without_events(struct path_context *c, const struct path_vertex *vertex, vec3 d, double t_min,
				double t_max, struct path_vertex *to, spectrum *transmittance)
{
	return trace_edge(c, vertex, d, t_min, t_max, 0, INFINITY, NULL, to, transmittance);
}

bool path_is_visible_in_media(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
			      struct path_edge *edge, spectrum *transmittance)
{
	double distance2;
	vec3 d = path_direction(z, y, &distance2);
	struct media_walk k = walk_begin(c, z, d, edge, NULL);
	struct path_vertex from = *z, face;
	double begin = path_ray_t_min(c->w, z, d);
	for (int i = 0; i < PATH_NULL_FACES_MAX; i++) {
		double end = y->kind == VERTEX_INFINITE ? INFINITY : vec3_length(vec3_sub(y->x.p, from.x.p));
		bool hit = c->w->has_null_faces && path_extend(c, &from, d, begin, end, &face);
		if (!hit || !is_null_face(c->w, &face)) {
			if (!path_is_visible(c, &from, y))
				return false;
			walk_advance(&k, from.x.p, begin, end);
			*transmittance = walk_end(&k);
			return true;
		}
		walk_advance(&k, from.x.p, begin, vec3_length(vec3_sub(face.x.p, from.x.p)));
		walk_cross_face(c, &k, &face.x);
		from = face;
		begin = 0;
	}
	return false;
}

double path_edge_pdf(const struct path_context *c, const struct path_edge *edge, uint32_t medium,
		     const struct path_vertex *to)
{
	if (to->kind != VERTEX_MEDIUM)
		return spectrum_mean(edge->scattering_transmittance);
	const struct medium *m = path_medium(c->w, medium);
	return spectrum_mean(
		spectrum_mul(medium_extinction(m, to->x.p, edge->d, &c->wl), edge->scattering_transmittance));
}

void path_apply_edge(const struct path_context *c, struct path_vertex *to, spectrum transmittance)
{
	double pdf = path_edge_pdf(c, &to->edge, to->edge.medium, to);
	to->pdf *= pdf;
	to->beta = pdf > 0 ? spectrum_scale(1 / pdf, spectrum_mul(to->beta, transmittance)) : spectrum_constant(0);
}

spectrum path_scatter_in_medium(const struct world *w, const struct wavelengths *wl, const struct path_vertex *v,
				vec3 wo, vec3 wi)
{
	const struct medium *m = path_medium(w, v->edge.medium);
	return spectrum_scale(phase_eval(&m->phase, v->x.p, wo, wi), medium_scattering(m, v->x.p, wo, wl));
}
